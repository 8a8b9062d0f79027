// SPDX-License-Identifier: Apache-2.0
//! Generates the C code of a policy's block, which copies ports to the network's inputs and its outputs back to ports.
use super::items::{Items, identifier, numbers, quoted};
use super::meaning::{Meaning, Term};
use super::network::Network;
use std::fmt::Write;

const KERNELS: &str = include_str!("kernels.h");
const PRODUCT: &str = include_str!("product.h");

/// Adds a line to the C code of a block.
macro_rules! line {
    ($text:expr, $($line:tt)*) => {{
        let _ = writeln!($text, $($line)*);
    }};
}

/// Returns the source of the block.
///
/// # Errors
/// Fails if the network is too large, or a name is not valid in C.
pub fn source(meaning: &Meaning, network: &Network, name: &str) -> Result<String, String> {
    let mut block = Block::new(meaning, network);
    let arguments = block.functions()?;
    block.before();
    for (at, (input, shape)) in network.inputs.iter().enumerate() {
        block.input(at, input, shape.iter().product())?;
    }
    for (at, (output, shape)) in network.outputs.iter().enumerate() {
        line!(block.body, "    float out{at}[{}] __attribute__((aligned(32)));", shape.iter().product::<usize>().max(1));
        for term in meaning.outputs.get(output).into_iter().flatten() {
            block.items.port(term, "out", &format!("'{output}' of the network"))?;
        }
    }
    line!(block.body, "#if defined(__x86_64__)\n    if (__builtin_cpu_supports(\"avx2\")) network_wide({arguments});\n    else\n#endif");
    line!(block.body, "    network_plain({arguments});");
    for (at, (output, shape)) in network.outputs.iter().enumerate() {
        block.output(at, output, shape.iter().product());
    }
    block.behind();
    let mut doc = if meaning.doc.is_empty() { format!("Learned policy '{name}'.") } else { meaning.doc.clone() };
    if !network.assumed.is_empty() {
        let _ = write!(doc, " Left open by the file: {}.", network.assumed.join(", "));
    }
    let Block { text, body, items, .. } = block;
    let (name, doc, items) = (identifier(name)?, quoted(&doc), items.declared()?);
    Ok(format!("{text}FUNCTION_BLOCK({name}, {doc},\n    {items})\n{{\n{body}    return OK;\n}}\n"))
}

/// A block being generated.
struct Block<'a> {
    meaning: &'a Meaning,
    network: &'a Network,
    items: Items,
    /// Code before the block: functions, constants.
    text: String,
    body: String,
    /// Number of elements of all ports so far.
    elements: usize,
}

impl<'a> Block<'a> {
    fn new(meaning: &'a Meaning, network: &'a Network) -> Self {
        Block { meaning, network, items: Items::default(), text: String::new(), body: String::new(), elements: 0 }
    }

    /// Generates the network as functions, one for each instruction set, and returns the code that calls them.
    fn functions(&mut self) -> Result<String, String> {
        let sides = [("const float *", "in", self.network.inputs.len()), ("float *", "out", self.network.outputs.len())];
        let list = |typed: bool| {
            let each = sides.iter().flat_map(|&(kind, name, len)| (0..len).map(move |i| format!("{}{name}{i}", if typed { kind } else { "" })));
            each.collect::<Vec<_>>().join(", ")
        };
        let (parameters, arguments) = (list(true), list(false));
        let program = &self.network.program;
        line!(self.text, "#include <opengpac.h>\n{KERNELS}\n{}", program.constants()?);
        let function = program.function(&parameters, &arguments)?;
        for (open, suffix, target, close) in [("#if defined(__x86_64__)\n", "wide", "target(\"avx2\"), ", "#endif\n"), ("", "plain", "", "")] {
            line!(self.text, "{open}#define SET {target}\n#define TARGET __attribute__((SET noinline, unused)) static");
            line!(
                self.text,
                "#define NAMED(name) name##_{suffix}\n#define product product_{suffix}\n#define network network_{suffix}\n#define PART(i) part_{suffix}_##i"
            );
            line!(self.text, "{PRODUCT}{function}#undef SET\n#undef TARGET\n#undef NAMED\n#undef product\n#undef network\n#undef PART\n{close}");
        }
        Ok(arguments)
    }

    /// Generates the check of the rate.
    fn before(&mut self) {
        line!(self.body, "    int64_t beyond = -1;");
        let Some(period) = self.meaning.period_ns else { return };
        line!(self.body, "    if (self->opengpac_last != 0) {{");
        line!(self.body, "        int64_t since = invocation->now_ns - (self->opengpac_last < 0 ? 0 : self->opengpac_last), rest = since % {period};");
        line!(self.body, "        if (since < {period} - {period} / 20) return FAULT(2);");
        line!(self.body, "        if (rest > {period} / 20 && {period} - rest > {period} / 20) return FAULT(2);\n    }}");
    }

    /// Generates the code that fills an input of the network.
    fn input(&mut self, at: usize, input: &str, len: usize) -> Result<(), String> {
        line!(self.body, "    float in{at}[{}] __attribute__((aligned(32)));", len.max(1));
        if let Some(output) = self.meaning.states.get(input) {
            let kept = self.items.state(&format!("state_{at}"), len, &format!("'{output}' of the invocation before"));
            line!(self.body, "    memcpy(in{at}, self->{kept}, {});", len * 4);
            return Ok(());
        }
        let mut start = 0;
        for term in self.meaning.inputs.get(input).into_iter().flatten() {
            let place = format!("in{at} + {start}");
            if term.previous.is_empty() {
                self.enter(term, &place)?;
            } else {
                let output = self.network.outputs.iter().position(|(name, _)| *name == term.previous).unwrap_or(0);
                line!(self.body, "    memcpy({place}, self->opengpac_raw_{output}, {});", term.size * 4);
            }
            start += term.width();
        }
        Ok(())
    }

    /// Generates the code that copies a port to an input, with its history if it has one.
    fn enter(&mut self, term: &Term, place: &str) -> Result<(), String> {
        let word = if term.mode == "synchronous" { "in" } else { "in_async" };
        self.items.port(term, word, "input")?;
        let (port, size, count, first) = (&term.port, term.size, term.history.max(1), self.elements);
        let newest = format!("{place} + {}", (count - 1) * size);
        line!(self.body, "    for (int i = 0; i < {size}; i++) {{\n        double v = self->{port}[i];\n        if (!(v - v == 0.0)) return FAULT(1);");
        if let Some([least, most]) = &term.within {
            line!(self.text, "static const double least_{port}[] = {}, most_{port}[] = {};", numbers(least), numbers(most));
            for (sign, end) in [('<', "least"), ('>', "most")] {
                line!(self.body, "        if (v {sign} {end}_{port}[i]) {{ v = {end}_{port}[i]; if (beyond < 0) beyond = {first} + i; }}");
            }
        }
        let steps = self.scaled(term, true);
        line!(self.body, "        {steps}\n        ({newest})[i] = (float)v;\n    }}");
        self.elements += size;
        if count > 1 {
            let kept = self.items.state(&format!("history_{port}"), size * count, &format!("the last {count} of {port}, as the network reads them"));
            let (all, row) = (size * count * 4, size * 4);
            line!(self.body, "    if (self->opengpac_last == 0)");
            line!(self.body, "        for (int i = 0; i < {count}; i++) memcpy(self->{kept} + i * {size}, {newest}, {row});");
            line!(self.body, "    memmove(self->{kept}, self->{kept} + {size}, {});", all - row);
            line!(self.body, "    memcpy(self->{kept} + {}, {newest}, {row});\n    memcpy({place}, self->{kept}, {all});", (count - 1) * size);
        }
        Ok(())
    }

    /// Generates the conversion from the unit of the port to the network's numbers, or back.
    fn scaled(&mut self, term: &Term, into: bool) -> String {
        let port = &term.port;
        let text = &mut self.text;
        let mut table = |what: &str, values: &[f64]| {
            line!(text, "static const double {what}_{port}[] = {};", numbers(values));
            format!("{what}_{port}[i]")
        };
        let offset = term.offset.as_ref().map(|offset| format!("v {}= {};", if into { '-' } else { '+' }, table("offset", offset)));
        let scale = term.scale.as_ref().map(|scale| format!("v *= {};", table("scale", scale)));
        let clip = term.clip.as_ref().map(|[least, most]| {
            let (least, most) = (table("low", least), table("high", most));
            format!("v = v < {least} ? {least} : v > {most} ? {most} : v;")
        });
        let steps = if into { [offset, clip, scale] } else { [scale, offset, clip] };
        steps.into_iter().flatten().collect::<Vec<_>>().join(" ")
    }

    /// Generates the code that copies an output of the network to ports, and to the states for the next invocation.
    fn output(&mut self, at: usize, output: &str, len: usize) {
        let (meaning, mut start) = (self.meaning, 0);
        for term in meaning.outputs.get(output).into_iter().flatten() {
            let (steps, port) = (self.scaled(term, false), &term.port);
            line!(self.body, "    for (int i = 0; i < {}; i++) {{\n        double v = out{at}[{start} + i];", term.size);
            line!(self.body, "        {steps}\n        self->{port}[i] = v;\n    }}");
            start += term.width();
        }
        if meaning.inputs.values().flatten().any(|term| term.previous == output) {
            let kept = self.items.state(&format!("raw_{at}"), len, &format!("'{output}' of the invocation before"));
            line!(self.body, "    memcpy(self->{kept}, out{at}, {});", len * 4);
        }
        let is_fed = |input: &str| meaning.states.get(input).is_some_and(|from| from == output);
        for (number, _) in self.network.inputs.iter().enumerate().filter(|(_, (input, _))| is_fed(input)) {
            line!(self.body, "    memcpy(self->opengpac_state_{number}, out{at}, {});", len * 4);
        }
    }

    /// Generates the conditions, and the time of the next check of the rate.
    fn behind(&mut self) {
        self.items.whole("state", "opengpac_last", "0, ", "time of the invocation before");
        line!(self.body, "    (void)beyond;\n    self->opengpac_last = invocation->now_ns == 0 ? -1 : invocation->now_ns;");
        if self.meaning.inputs.values().flatten().any(|term| term.previous.is_empty() && term.within.is_some()) {
            let doc = "an input is beyond the range of training: the number of its element; the network received the end of the range";
            self.items.whole("condition_of", "out_of_distribution", "", doc);
            line!(self.body, "    if (beyond >= 0) report_value(out_of_distribution, beyond);");
        }
        if let Some(age) = self.meaning.age_max_ns {
            self.items.whole("in_async", "observed", "", "time at which the inputs were observed, in ns of the system's clock");
            self.items.whole("condition_of", "stale", "", "the inputs are older than declared: their age in ns");
            line!(self.body, "    if (invocation->now_ns - self->observed > {age}) report_value(stale, invocation->now_ns - self->observed);");
        }
    }
}
