//! `idmesh batch --shard auto`: the jobs of an array take each design once.

use std::collections::BTreeSet;
use std::fs;

use crate::fixture::*;

const BATCH: [&str; 9] =
    ["batch", "case.toml", "--backend", "cpu", "--designs", "designs", "--out", "moved", "--no-wait"];

/// Runs a job with `--shard auto` and these variables.
fn job(fixture: &Fixture, variables: &[(&str, &str)]) -> std::process::Output {
    let mut command = command(fixture.folder.path(), &[&BATCH[..8], &["--shard", "auto"]].concat());
    // The tests may themselves run in a job.
    for (name, _) in std::env::vars_os() {
        let name = name.to_string_lossy().into_owned();
        let of_job = ["SLURM_", "AWS_BATCH_", "LSB_", "SGE_", "PBS_", "OMPI_", "PMI_", "PMIX_"];
        if of_job.iter().any(|beginning| name.starts_with(beginning)) {
            command.env_remove(name);
        }
    }
    command.envs(variables.iter().copied()).output().unwrap()
}

fn moved(fixture: &Fixture) -> BTreeSet<String> {
    let entries = fs::read_dir(fixture.path("moved")).into_iter().flatten();
    entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
}

#[test]
fn jobs_of_an_array_take_each_design_once() {
    let fixture = Fixture::with_designs(5);
    let mut all = BTreeSet::new();
    for index in ["0", "1", "2"] {
        let output = job(&fixture, &[("AWS_BATCH_JOB_ARRAY_INDEX", index), ("AWS_BATCH_JOB_ARRAY_SIZE", "3")]);
        assert_good(&output);
        let number = index.parse::<usize>().unwrap() + 1;
        let told = format!("shard {number}/3 by AWS_BATCH_JOB_ARRAY_INDEX={index}, AWS_BATCH_JOB_ARRAY_SIZE=3\n");
        assert!(stderr(&output).starts_with(&told), "{}", stderr(&output));
        let own = moved(&fixture);
        assert!(all.is_disjoint(&own), "{all:?} and {own:?}");
        all.extend(own);
        fs::remove_dir_all(fixture.path("moved")).unwrap();
    }
    assert_eq!(all.len(), 5);
}

/// A job that does not know its share moves nothing, and takes no result of another away.
#[test]
fn a_job_without_a_share_is_refused() {
    let fixture = Fixture::with_designs(2);
    fs::create_dir(fixture.path("moved")).unwrap();
    fixture.write("moved/0.msh", "of another job");
    let refused = |variables: &[(&str, &str)], words: &[&str]| {
        let output = job(&fixture, variables);
        assert_eq!(output.status.code(), Some(3), "{}", stderr(&output));
        for word in words {
            assert!(stderr(&output).contains(word), "\"{word}\" is not in {}", stderr(&output));
        }
        assert_eq!(fixture.read("moved/0.msh"), "of another job");
        assert_eq!(moved(&fixture).len(), 1);
    };
    refused(&[], &["error: no share of the designs is known: none of SLURM_ARRAY_TASK_ID", "hint: --shard I/N"]);
    let pbs = [("PBS_ARRAY_INDEX", "2")];
    refused(&pbs, &["PBS_ARRAY_INDEX=2: PBS does not tell the number of jobs", "--shard $PBS_ARRAY_INDEX/10"]);
    let escape = [("SLURM_ARRAY_TASK_ID", "\x1b[2J")];
    refused(&escape, &["SLURM_ARRAY_TASK_ID is \"\\x1b[2J\", expected a whole number"]);
    let wrong = fixture.idmesh(&[&BATCH[..8], &["--shard", "automatic"]].concat());
    assert_eq!(wrong.status.code(), Some(2));
    assert!(stderr(&wrong).contains("expected I/N with I from 1 to N, such as 3/10, or auto"), "{}", stderr(&wrong));
}
