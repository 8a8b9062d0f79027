//! A first-order lag: y' = (u - y) / tau, with the step of Euler.
use fmi::fmi3::{Fmi3Error, Fmi3Res};
use fmi_export::fmi3::{CSDoStepResult, Context, DefaultLoggingCategory, UserModel};
use fmi_export::FmuModel;

#[derive(FmuModel, Default, Debug)]
#[model(model_exchange = false, co_simulation = true, user_model = false)]
pub struct Lag {
    #[variable(causality = Input, variability = Continuous, start = 0.0)]
    u: f64,
    #[variable(causality = Output, variability = Continuous, start = 0.0, initial = Exact)]
    y: f64,
    #[variable(causality = Parameter, variability = Fixed, start = 0.5, initial = Exact)]
    tau: f64,
}

impl UserModel for Lag {
    type LoggingCategory = DefaultLoggingCategory;

    fn calculate_values(&mut self, _: &dyn Context<Self>) -> Result<Fmi3Res, Fmi3Error> {
        Ok(Fmi3Res::OK)
    }

    fn do_step(&mut self, context: &mut dyn Context<Self>, at: f64, step: f64, _: bool) -> Result<CSDoStepResult, Fmi3Error> {
        self.y += (self.u - self.y) / self.tau * step;
        context.set_time(at + step);
        Ok(CSDoStepResult::completed(at + step))
    }
}

fmi_export::export_fmu!(Lag);
