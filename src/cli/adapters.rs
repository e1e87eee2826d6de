//! `idmesh adapters` lists the GPUs and marks the one that `--backend auto` takes.

use serde::Serialize;

use super::console::Console;
use super::failure::Failure;
use super::json::{check_json, write_json};
use super::{JsonTarget, json_target};
use crate::backend::{self, AdapterSummary};

/// Arguments of `idmesh adapters`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// Write the list as JSON; `-` is standard output.
    #[arg(long, value_name = "FILE", value_parser = json_target)]
    json: Option<JsonTarget>,
}

#[derive(Debug, Serialize)]
struct Entry<'a> {
    name: &'a str,
    kind: &'a str,
    driver: &'a str,
    api: &'a str,
    max_array_bytes: u64,
    arithmetic: &'a str,
    auto: bool,
}

/// Runs the command.
pub(super) fn run(arguments: &Arguments, console: &Console) -> Result<(), Failure> {
    check_json(arguments.json.as_ref(), console)?;
    let adapters = backend::adapters();
    if let Some(target) = &arguments.json {
        let entries: Vec<_> = adapters
            .iter()
            .map(|AdapterSummary { name, kind, driver, api, max_array_bytes, arithmetic, auto }| Entry {
                name,
                kind,
                driver,
                api,
                max_array_bytes: *max_array_bytes,
                arithmetic: arithmetic.name(),
                auto: *auto,
            })
            .collect();
        write_json(target, &entries, console)?;
    }
    if arguments.json != Some(JsonTarget::StandardOutput) {
        console.data(&text(&adapters))?;
    }
    Ok(())
}

fn text(adapters: &[AdapterSummary]) -> String {
    if adapters.is_empty() {
        return "no adapters; auto computes on the CPU\n".into();
    }
    let mut text = String::new();
    for adapter in adapters {
        let AdapterSummary { name, kind, driver, api, max_array_bytes, arithmetic, auto } = adapter;
        let marker = if *auto { "  <- auto takes this one" } else { "" };
        let mebibytes = max_array_bytes >> 20;
        let arithmetic = arithmetic.name();
        text += &format!("{name}: {kind}, {api}, {driver}, arrays up to {mebibytes} MiB, {arithmetic}{marker}\n");
    }
    if !adapters.iter().any(|adapter| adapter.auto) {
        text += "auto computes on the CPU: none of these is hardware\n";
    }
    text
}
