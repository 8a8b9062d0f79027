// SPDX-License-Identifier: Apache-2.0
//! The C of a policy's block: from ports to the network's inputs and back.
use super::meaning::{Meaning, Term};
use super::network::Network;
use std::fmt::Write;

const KERNELS: &str = include_str!("kernels.h");
const PRODUCT: &str = include_str!("product.h");

/// The source of the block.
///
/// # Errors
/// The network is too large, or a name is none in C.
pub fn source(meaning: &Meaning, network: &Network, name: &str) -> Result<String, String> {
    let parameters: Vec<String> =
        (0..network.inputs.len()).map(|i| format!("const float *in{i}")).chain((0..network.outputs.len()).map(|i| format!("float *out{i}"))).collect();
    let arguments: Vec<String> = (0..network.inputs.len()).map(|i| format!("in{i}")).chain((0..network.outputs.len()).map(|i| format!("out{i}"))).collect();
    let (parameters, arguments) = (parameters.join(", "), arguments.join(", "));
    let mut text = format!("#include <opengpac.h>\n{KERNELS}\n{}", network.program.constants()?);
    let function = network.program.function(&parameters, &arguments)?;
    for (open, suffix, target, close) in [("#if defined(__x86_64__)\n", "wide", "target(\"avx2\"), ", "#endif\n"), ("", "plain", "", "")] {
        let _ = write!(
            text,
            "{open}#define TARGET __attribute__(({target}noinline, unused)) static\n#define product product_{suffix}\n#define network network_{suffix}\n#define PART(i) part_{suffix}_##i\n{PRODUCT}{function}#undef TARGET\n#undef product\n#undef network\n#undef PART\n{close}"
        );
    }
    let mut items = Items::default();
    let mut body = String::new();
    let mut first = 0;
    for (at, (input, shape)) in network.inputs.iter().enumerate() {
        let len: usize = shape.iter().product();
        let _ = writeln!(body, "    float in{at}[{}] __attribute__((aligned(32)));", len.max(1));
        if let Some(output) = meaning.states.get(input) {
            let kept = items.state(&format!("state_{at}"), len, &format!("'{output}' of the invocation before"));
            let _ = writeln!(body, "    memcpy(in{at}, self->{kept}, {});", len * 4);
            continue;
        }
        let mut start = 0;
        for term in meaning.inputs.get(input).into_iter().flatten() {
            enter(&mut items, &mut text, &mut body, term, at, start, &mut first, network)?;
            start += term.width();
        }
    }
    for (at, (output, shape)) in network.outputs.iter().enumerate() {
        let _ = writeln!(body, "    float out{at}[{}] __attribute__((aligned(32)));", shape.iter().product::<usize>().max(1));
        for term in meaning.outputs.get(output).into_iter().flatten() {
            items.port(term, "out", &format!("{}{}", term.doc_or(output), of_elements(term)))?;
        }
    }
    let _ = writeln!(
        body,
        "#if defined(__x86_64__)\n    if (__builtin_cpu_supports(\"avx2\")) network_wide({arguments});\n    else\n#endif\n    network_plain({arguments});"
    );
    for (at, (output, _)) in network.outputs.iter().enumerate() {
        leave(&mut items, &mut text, &mut body, meaning, network, (at, output));
    }
    let ends = conditions(&mut items, meaning);
    if items.list.len() > 32 {
        return Err(format!("its block would have {} items, 32 are the most: join ports", items.list.len()));
    }
    let doc = if meaning.doc.is_empty() { format!("Learned policy '{name}'.") } else { meaning.doc.clone() };
    let _ = write!(
        text,
        "FUNCTION_BLOCK({}, {},\n    {})\n{{\n{}{body}{}    return OK;\n}}\n",
        identifier(name)?,
        quoted(&doc),
        items.list.join(",\n    "),
        ends.0,
        ends.1
    );
    Ok(text)
}

#[derive(Default)]
struct Items {
    list: Vec<String>,
    has_range: bool,
}

impl Items {
    fn port(&mut self, term: &Term, word: &str, doc: &str) -> Result<(), String> {
        let unit = if term.unit.is_empty() { String::new() } else { format!(", {}", quoted(&term.unit)) };
        self.list.push(format!("{word}(double[{}], {}, {}{unit})", term.size, identifier(&term.port)?, quoted(doc)));
        Ok(())
    }

    fn state(&mut self, name: &str, len: usize, doc: &str) -> String {
        self.list.push(format!("state(float[{}], opengpac_{name}, 0, {})", len.max(1), quoted(doc)));
        format!("opengpac_{name}")
    }
}

impl Term {
    fn doc_or(&self, of: &str) -> String {
        if self.doc.is_empty() { format!("'{of}' of the network") } else { self.doc.clone() }
    }
}

#[allow(clippy::too_many_arguments)]
fn enter(
    items: &mut Items,
    text: &mut String,
    body: &mut String,
    term: &Term,
    at: usize,
    start: usize,
    first: &mut usize,
    network: &Network,
) -> Result<(), String> {
    let size = term.size;
    if !term.previous.is_empty() {
        let output = network.outputs.iter().position(|(name, _)| *name == term.previous).unwrap_or(0);
        let _ = writeln!(body, "    memcpy(in{at} + {start}, self->opengpac_raw_{output}, {});", size * 4);
        return Ok(());
    }
    let word = if term.mode == "synchronous" { "in" } else { "in_async" };
    items.port(term, word, &format!("{}{}", term.doc_or("input"), of_elements(term)))?;
    let (port, count) = (&term.port, term.history.max(1));
    let _ = writeln!(body, "    for (int i = 0; i < {size}; i++) {{\n        double v = self->{port}[i];\n        if (!(v - v == 0.0)) return FAULT(1);");
    if let Some([least, most]) = &term.within {
        items.has_range = true;
        let _ = writeln!(text, "static const double least_{port}[] = {}, most_{port}[] = {};", numbers(least), numbers(most));
        let _ = writeln!(body, "        if (v < least_{port}[i]) {{ v = least_{port}[i]; if (beyond < 0) beyond = {first} + i; }}");
        let _ = writeln!(body, "        if (v > most_{port}[i]) {{ v = most_{port}[i]; if (beyond < 0) beyond = {first} + i; }}");
    }
    let _ = writeln!(body, "        {}", scaled(text, term, port, true));
    let target = start + (count - 1) * size;
    let _ = writeln!(body, "        in{at}[{target} + i] = (float)v;\n    }}");
    *first += size;
    if count > 1 {
        let kept = items.state(&format!("history_{port}"), size * count, &format!("the last {count} of {port}, as the network reads them"));
        let (all, row) = (size * count * 4, size * 4);
        let _ =
            writeln!(body, "    if (self->opengpac_last == 0) for (int i = 0; i < {count}; i++) memcpy(self->{kept} + i * {size}, in{at} + {target}, {row});");
        let _ = writeln!(
            body,
            "    memmove(self->{kept}, self->{kept} + {size}, {});\n    memcpy(self->{kept} + {}, in{at} + {target}, {row});",
            all - row,
            (count - 1) * size
        );
        let _ = writeln!(body, "    memcpy(in{at} + {start}, self->{kept}, {all});");
    }
    Ok(())
}

/// From the unit of the port to the network's numbers, or back.
fn scaled(text: &mut String, term: &Term, port: &str, into: bool) -> String {
    let mut steps = Vec::new();
    let mut table = |what: &str, values: &Vec<f64>| {
        let _ = writeln!(text, "static const double {what}_{port}[] = {};", numbers(values));
        format!("{what}_{port}[i]")
    };
    if let (Some(offset), true) = (&term.offset, into) {
        steps.push(format!("v -= {};", table("offset", offset)));
    }
    if let (Some(scale), false) = (&term.scale, into) {
        steps.push(format!("v *= {};", table("scale", scale)));
    }
    if let (Some(offset), false) = (&term.offset, into) {
        steps.push(format!("v += {};", table("offset", offset)));
    }
    if let Some([least, most]) = &term.clip {
        let (least, most) = (table("low", least), table("high", most));
        steps.push(format!("v = v < {least} ? {least} : v > {most} ? {most} : v;"));
    }
    if let (Some(scale), true) = (&term.scale, into) {
        steps.push(format!("v *= {};", table("scale", scale)));
    }
    steps.join(" ")
}

fn leave(items: &mut Items, text: &mut String, body: &mut String, meaning: &Meaning, network: &Network, (at, output): (usize, &str)) {
    let len: usize = network.outputs[at].1.iter().product();
    let mut start = 0;
    for term in meaning.outputs.get(output).into_iter().flatten() {
        let steps = scaled(text, term, &term.port, false);
        let _ = writeln!(body, "    for (int i = 0; i < {}; i++) {{ double v = out{at}[{start} + i]; {steps} self->{}[i] = v; }}", term.size, term.port);
        start += term.width();
    }
    if meaning.inputs.values().flatten().any(|term| term.previous == output) {
        let kept = items.state(&format!("raw_{at}"), len, &format!("'{output}' of the invocation before"));
        let _ = writeln!(body, "    memcpy(self->{kept}, out{at}, {});", len * 4);
    }
    for (number, _) in network.inputs.iter().enumerate().filter(|(_, (input, _))| meaning.states.get(input).is_some_and(|from| from == output)) {
        let _ = writeln!(body, "    memcpy(self->opengpac_state_{number}, out{at}, {});", len * 4);
    }
}

/// Conditions, the check of the rate, and what of them stands before and behind the body.
fn conditions(items: &mut Items, meaning: &Meaning) -> (String, String) {
    let (mut before, mut behind) = (
        "    int64_t beyond = -1;\n".to_string(),
        "    (void)beyond;\n    self->opengpac_last = invocation->now_ns == 0 ? -1 : invocation->now_ns;\n".to_string(),
    );
    items.list.push("state(int64_t, opengpac_last, 0, \"time of the invocation before\")".to_string());
    if let Some(period) = meaning.period_ns {
        let _ = writeln!(
            before,
            "    if (self->opengpac_last != 0) {{\n        int64_t since = invocation->now_ns - (self->opengpac_last < 0 ? 0 : self->opengpac_last), rest = since % {period};\n        if (since < {period} - {period} / 20 || (rest > {period} / 20 && {period} - rest > {period} / 20)) return FAULT(2);\n    }}"
        );
    }
    if items.has_range {
        items.list.push("condition_of(int64_t, out_of_distribution, \"an input is beyond the range of training: the number of its element; the network got the end of the range\")".to_string());
        behind.push_str("    if (beyond >= 0) report_value(out_of_distribution, beyond);\n");
    }
    if let Some(age) = meaning.age_max_ns {
        items.list.push("in_async(int64_t, observed, \"time at which the inputs were observed, in ns of the system's clock\")".to_string());
        items.list.push("condition_of(int64_t, stale, \"the inputs are older than was declared: their age in ns\")".to_string());
        let _ = writeln!(behind, "    if (invocation->now_ns - self->observed > {age}) report_value(stale, invocation->now_ns - self->observed);");
    }
    (before, behind)
}

fn of_elements(term: &Term) -> String {
    if term.names.is_empty() { String::new() } else { format!(": {}", term.names.join(", ")) }
}

fn numbers(values: &[f64]) -> String {
    let number = |x: &f64| {
        if x.is_finite() {
            format!("{x:e}")
        } else if *x > 0.0 {
            "__builtin_inf()".to_string()
        } else {
            "-__builtin_inf()".to_string()
        }
    };
    format!("{{{}}}", values.iter().map(number).collect::<Vec<_>>().join(", "))
}

fn quoted(text: &str) -> String {
    let letters: String = text
        .chars()
        .map(|c| match c {
            '"' | '\\' => format!("\\{c}"),
            c if c.is_control() => " ".to_string(),
            c => c.to_string(),
        })
        .collect();
    format!("\"{letters}\"")
}

fn identifier(name: &str) -> Result<&str, String> {
    let is_one = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_') && name.starts_with(|c: char| c.is_ascii_alphabetic());
    if is_one { Ok(name) } else { Err(format!("'{name}' is no name of a port or block: use letters, digits and _")) }
}
