// SPDX-License-Identifier: Apache-2.0
//! Program that runs on the controller: it follows goals, and stops the arm when none arrives.
use super::states::SILENT;

/// Duration of a controller cycle on an e-series.
pub(super) const CYCLE_NS: i64 = 2_000_000;

/// Parameters of the program.
#[derive(Clone, Copy, Debug)]
pub(super) struct Program {
    /// Number of the session. The program reports it while it runs, and follows only goals sent with it, so that goals left in the
    /// registers by another session are ignored.
    pub session: i32,
    /// Number of cycles for which the program waits for a new beat.
    pub patience: i64,
    /// Look-ahead time, s, and gain of `servoj`.
    pub lookahead_s: f64,
    pub gain: f64,
    /// Deceleration with which the arm comes to rest, rad/s².
    pub deceleration: f64,
}

impl Program {
    /// Returns the text of the program. The program begins at rest, follows only goals of its own session, and comes to a stop before
    /// every exit.
    pub fn text(&self) -> String {
        let Program { session, patience, lookahead_s, gain, deceleration } = self;
        let goals = (24..30).map(|register| format!("read_input_float_register({register})")).collect::<Vec<_>>().join(", ");
        format!(
            "def opengpac():
  beat = read_input_integer_register(24)
  missed = 0
  moving = False
  left = 0
  write_output_integer_register(24, {session})
  while left == 0:
    now = read_input_integer_register(24)
    mode = read_input_integer_register(25)
    if now != beat:
      beat = now
      missed = 0
    else:
      missed = missed + 1
    end
    if missed > {patience}:
      left = {SILENT}
    elif mode == -1:
      left = -2
    elif mode == {session}:
      moving = True
      servoj([{goals}], t=0.002, lookahead_time={lookahead_s}, gain={gain})
    elif moving:
      stopj({deceleration})
      moving = False
    else:
      sync()
    end
  end
  stopj({deceleration})
  write_output_integer_register(24, left)
end
"
        )
    }
}
