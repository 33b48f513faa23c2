//! Renders one scene of a pair, with or without an effect, or without it and yet forced to simulate it, on one thread: to count the instructions
//! of (`tools/reference/effect_pairs.py`). Prints a hash of the picture's bits.
//!
//!     effect_pairs list
//!     effect_pairs "curvature filter" without 8

#![allow(clippy::print_stdout, reason = "its output is what it is for")]

#[path = "../tests/support/pairs.rs"]
mod pairs;

use std::ops::ControlFlow;
use std::process::ExitCode;

use osculate_render::{EFFECTS, RenderOptions, StopRule, plan, render};

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let done = match arguments.as_slice() {
        ["list"] => {
            for effect in EFFECTS.into_iter().chain([pairs::ALL_BUT_A_SUN]) {
                println!("{effect}");
            }
            Ok(())
        }
        [effect, side @ ("with" | "without" | "forced"), samples] => picture(effect, side, samples),
        _ => Err("usage: effect_pairs list | EFFECT with|without|forced SAMPLES".to_owned()),
    };
    let Err(message) = done else { return ExitCode::SUCCESS };
    eprintln!("error: {message}");
    ExitCode::from(2)
}

fn picture(effect: &str, side: &str, samples: &str) -> Result<(), String> {
    let pair = pairs::pair(effect).ok_or_else(|| format!("no effect is called {effect:?}"))?;
    let case = if side == "with" { Some(&pair.with) } else { pair.without.first() };
    let case = case.ok_or_else(|| format!("no scene without {effect}"))?;
    let samples: u32 = samples.parse().map_err(|_| format!("{samples:?} is not a number of samples"))?;
    let stop = StopRule::Samples(samples);
    let planned = plan(&case.scene, case.max_depth).effects();
    let force = (side == "forced").then(|| pairs::forcing(effect, planned));
    let options = RenderOptions { stop, force, max_depth: case.max_depth, ..RenderOptions::default() };
    // This thread is the pool, so that no other one waits in a loop.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    let rendering = pool
        .map_err(|e| e.to_string())?
        .install(|| render(&case.scene, &options, &mut |_| ControlFlow::Continue(())))
        .map_err(|e| e.to_string())?;
    let bits = rendering.film.radiance().into_iter().flat_map(|p| p.to_array()).map(f32::to_bits);
    // FNV-1a, word by word.
    let hash = bits.fold(0xcbf2_9ce4_8422_2325_u64, |hash, word| {
        (hash ^ u64::from(word)).wrapping_mul(0x0100_0000_01b3)
    });
    println!("{hash:016x} {}", rendering.counters.samples);
    Ok(())
}
