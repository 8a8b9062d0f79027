// SPDX-License-Identifier: Apache-2.0
//! Runs seeds for a given time, a given number of seeds, or a single seed: `simulate --help`.
use simulator::{Failure, run, shrink};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

#[global_allocator]
static ALLOCATOR: simulator::memory::Counting = simulator::memory::Counting;

const HELP: &str = "simulate [--seeds N | --seconds S] [--first SEED] [--jobs N]    seeds one after the other; the first is of the day
simulate --seed N [--keep 3,7,12] [--story] [--definitions]                     one seed again, or only these of its operations";

#[derive(Default)]
struct CommandLine {
    seeds: Option<u64>,
    seconds: Option<u64>,
    first: Option<u64>,
    seed: Option<u64>,
    keep: Option<Vec<usize>>,
    story: bool,
    definitions: bool,
}

fn asked() -> Result<CommandLine, String> {
    let mut asked = CommandLine::default();
    let mut words = std::env::args().skip(1);
    while let Some(word) = words.next() {
        let mut number = || words.next().and_then(|text| text.parse::<u64>().ok()).ok_or(format!("{word} wants a number"));
        match word.as_str() {
            "--seeds" => asked.seeds = Some(number()?),
            "--seconds" => asked.seconds = Some(number()?),
            "--first" => asked.first = Some(number()?),
            "--seed" => asked.seed = Some(number()?),
            "--story" => asked.story = true,
            "--definitions" => asked.definitions = true,
            "--keep" => {
                let text = words.next().unwrap_or_default();
                asked.keep = Some(text.split(',').filter_map(|index| index.trim().parse().ok()).collect());
            }
            _ => return Err(HELP.to_owned()),
        }
    }
    Ok(asked)
}

/// Returns today's first seed; each day has 10 million seeds.
fn first_of_today() -> u64 {
    let days = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 86_400);
    days * 10_000_000
}

fn main() {
    let asked = asked().unwrap_or_else(|why| {
        eprintln!("{why}");
        std::process::exit(2)
    });
    if let Some(seed) = asked.seed {
        let outcome = run(seed, asked.keep.as_deref());
        if asked.definitions {
            let program = simulator::program::Program::random(&simulator::seed::Numbers::of(seed));
            program.sources.iter().for_each(|source| println!("{source:?}"));
            println!("{:?}, the plant at source {:?}", program.carrier, program.plant);
            program.verbs.iter().for_each(|verb| println!("{:#}", verb.definition));
        }
        if asked.story {
            outcome.story.iter().for_each(|line| println!("{line}"));
        }
        match outcome.failure {
            Some(failure) if asked.keep.is_none() => fail(&failure),
            Some(failure) => tell(&failure),
            None => println!(
                "seed {seed}: everything holds after {} operations, {} starts, {} ms",
                outcome.operations,
                outcome.starts,
                outcome.virtual_ns / 1_000_000
            ),
        }
        return;
    }
    let first = asked.first.unwrap_or_else(first_of_today);
    let (begun, mut last_told) = (Instant::now(), Instant::now());
    let seconds = asked.seconds.or(asked.seeds.is_none().then_some(60));
    println!("seeds from {first} on");
    let (mut count, mut operations, mut starts, mut accepted, mut refused, mut virtual_ns) = (0u64, 0, 0, 0, 0, 0i64);
    while asked.seeds.is_none_or(|seeds| count < seeds) && seconds.is_none_or(|seconds| begun.elapsed() < Duration::from_secs(seconds)) {
        let outcome = run(first + count, None);
        if let Some(failure) = outcome.failure {
            println!("after {count} seeds, {:.1} s:", begun.elapsed().as_secs_f64());
            fail(&failure);
        }
        count += 1;
        operations += outcome.operations;
        starts += outcome.starts;
        accepted += outcome.accepted;
        refused += outcome.refused;
        virtual_ns += outcome.virtual_ns;
        if last_told.elapsed() > Duration::from_secs(20) {
            last_told = Instant::now();
            println!("{count} seeds, {:.0} a second", count as f64 / begun.elapsed().as_secs_f64());
        }
    }
    println!(
        "{count} seeds without a failure in {:.1} s ({:.0} a second): {operations} operations, {starts} starts, {accepted} calls accepted, {refused} refused, {:.0} s on the systems' clocks",
        begun.elapsed().as_secs_f64(),
        count as f64 / begun.elapsed().as_secs_f64(),
        virtual_ns as f64 * 1e-9
    );
}

/// Shrinks a failure, reports it, and exits with an error.
fn fail(failure: &Failure) -> ! {
    println!("seed {}: {}: {}", failure.seed, failure.broken.invariant, failure.broken.text);
    println!("shrinking {} operations …", failure.kept.len());
    let least = shrink(failure);
    tell(&least);
    let kept: Vec<String> = least.kept.iter().map(usize::to_string).collect();
    println!("again: simulate --seed {} --keep {} --story", least.seed, kept.join(","));
    std::process::exit(1)
}

fn tell(failure: &Failure) {
    println!("seed {}, {} operations:", failure.seed, failure.kept.len());
    failure.story.iter().for_each(|line| println!("  {line}"));
    println!("  {}: {}", failure.broken.invariant, failure.broken.text);
}
