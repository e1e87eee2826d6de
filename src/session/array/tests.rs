use super::*;

/// The share by variables, with the variables that were used.
fn of(variables: &[(&str, &str)]) -> Result<(String, Vec<String>), String> {
    let get = |name: &str| variables.iter().find(|(other, _)| *other == name).map(|(_, value)| (*value).to_owned());
    let job = ArrayJob::of_variables(get).map_err(|error| error.to_string())?;
    Ok((job.shard.to_string(), job.from))
}

#[track_caller]
fn is(variables: &[(&str, &str)], share: &str, from: &[&str]) {
    assert_eq!(of(variables), Ok((share.to_owned(), from.iter().map(|name| (*name).to_owned()).collect())));
}

#[track_caller]
fn refused(variables: &[(&str, &str)], words: &[&str]) {
    let error = of(variables).unwrap_err();
    for word in words {
        assert!(error.contains(word), "\"{word}\" is not in: {error}");
    }
}

/// Every job of `sbatch --array=FIRST-LAST:STEP`.
fn slurm<'v>(id: &'v str, min: &'v str, max: &'v str, step: &'v str, count: &'v str) -> [(&'v str, &'v str); 5] {
    [
        ("SLURM_ARRAY_TASK_ID", id),
        ("SLURM_ARRAY_TASK_MIN", min),
        ("SLURM_ARRAY_TASK_MAX", max),
        ("SLURM_ARRAY_TASK_STEP", step),
        ("SLURM_ARRAY_TASK_COUNT", count),
    ]
}

#[test]
fn slurm_arrays_may_begin_anywhere_and_have_steps() {
    let share = |variables: &[(&str, &str)]| of(variables).unwrap().0;
    for (id, expected) in [("1", "1/4"), ("2", "2/4"), ("3", "3/4"), ("4", "4/4")] {
        assert_eq!(share(&slurm(id, "1", "4", "1", "4")), expected);
    }
    assert_eq!(share(&slurm("0", "0", "9", "1", "10")), "1/10");
    assert_eq!(share(&slurm("9", "0", "9", "1", "10")), "10/10");
    // --array=10-31:7 has the jobs 10, 17, 24 and 31.
    for (id, expected) in [("10", "1/4"), ("17", "2/4"), ("24", "3/4"), ("31", "4/4")] {
        assert_eq!(share(&slurm(id, "10", "31", "7", "4")), expected);
        // Old versions tell no step.
        let all = slurm(id, "10", "31", "7", "4");
        assert_eq!(share(&all.into_iter().filter(|(name, _)| !name.ends_with("STEP")).collect::<Vec<_>>()), expected);
    }
    is(
        &slurm("3", "1", "4", "1", "4"),
        "3/4",
        &[
            "SLURM_ARRAY_TASK_ID=3",
            "SLURM_ARRAY_TASK_COUNT=4",
            "SLURM_ARRAY_TASK_MIN=1",
            "SLURM_ARRAY_TASK_MAX=4",
            "SLURM_ARRAY_TASK_STEP=1",
        ],
    );
}

/// A list such as --array=1,3,7 has gaps that the variables do not tell.
#[test]
fn slurm_arrays_with_gaps_are_refused() {
    for id in ["1", "3", "7"] {
        refused(&slurm(id, "1", "7", "1", "3"), &["3 jobs are no series", &format!("SLURM_ARRAY_TASK_ID={id}")]);
    }
    refused(&slurm("8", "1", "7", "1", "7"), &["not in the series from 1 to 7"]);
    refused(&slurm("2", "1", "7", "2", "4"), &["not in the series"]);
    refused(&slurm("0", "1", "7", "1", "7"), &["not in the series"]);
    refused(&slurm("1", "1", "7", "0", "7"), &["steps of 0"]);
    refused(&slurm("one", "1", "7", "1", "7"), &["SLURM_ARRAY_TASK_ID is \"one\", expected a whole number"]);
    refused(&slurm("-1", "1", "7", "1", "7"), &["expected a whole number"]);
    refused(&slurm("1", "1", "7", "1", "7")[..2], &["SLURM_ARRAY_TASK_COUNT is not", "SLURM_ARRAY_TASK_ID=1"]);
    refused(&[("SLURM_ARRAY_TASK_ID", "1"), ("SLURM_ARRAY_TASK_COUNT", "7")], &["SLURM_ARRAY_TASK_MIN is not"]);
}

#[test]
fn other_schedulers_have_arrays() {
    let aws = |index, size| [("AWS_BATCH_JOB_ARRAY_INDEX", index), ("AWS_BATCH_JOB_ARRAY_SIZE", size)];
    is(&aws("0", "3"), "1/3", &["AWS_BATCH_JOB_ARRAY_INDEX=0", "AWS_BATCH_JOB_ARRAY_SIZE=3"]);
    is(&aws("2", "3"), "3/3", &["AWS_BATCH_JOB_ARRAY_INDEX=2", "AWS_BATCH_JOB_ARRAY_SIZE=3"]);
    refused(&aws("3", "3"), &["beyond the last of 3 jobs", "AWS_BATCH_JOB_ARRAY_INDEX=3"]);
    refused(&aws("0", "0"), &["beyond the last of 0 jobs"]);
    refused(&aws("0", "3")[..1], &["AWS_BATCH_JOB_ARRAY_SIZE is not"]);

    is(&[("LSB_JOBINDEX", "5"), ("LSB_JOBINDEX_END", "10")], "5/10", &["LSB_JOBINDEX=5", "LSB_JOBINDEX_END=10"]);
    let steps = [("LSB_JOBINDEX", "7"), ("LSB_JOBINDEX_END", "10"), ("LSB_JOBINDEX_STEP", "3")];
    assert_eq!(of(&steps).unwrap().0, "3/4");
    refused(&[("LSB_JOBINDEX", "5")], &["LSB_JOBINDEX_END is not"]);
    refused(&[("LSB_JOBINDEX", "11"), ("LSB_JOBINDEX_END", "10")], &["not in the series"]);
    refused(&[("LSB_JOBINDEX", "0"), ("LSB_JOBINDEX_END", "0")], &["none of SLURM_ARRAY_TASK_ID"]);

    let sge = |id, first, last, step| {
        [("SGE_TASK_ID", id), ("SGE_TASK_FIRST", first), ("SGE_TASK_LAST", last), ("SGE_TASK_STEPSIZE", step)]
    };
    assert_eq!(of(&sge("2", "2", "10", "4")).unwrap().0, "1/3");
    assert_eq!(of(&sge("10", "2", "10", "4")).unwrap().0, "3/3");
    // The last number of qsub -t need not be met by the steps.
    assert_eq!(of(&sge("10", "2", "13", "4")).unwrap().0, "3/3");
    refused(&sge("3", "2", "10", "4"), &["not in the series from 2 to 10 in steps of 4"]);
    refused(&sge("2", "2", "10", "4")[..2], &["SGE_TASK_LAST is not"]);
    refused(&sge("undefined", "undefined", "undefined", "undefined"), &["none of"]);

    for name in ["PBS_ARRAY_INDEX", "PBS_ARRAYID"] {
        refused(&[(name, "3")], &["PBS does not tell the number of jobs, expected --shard I/N", &format!("{name}=3")]);
    }
    refused(&[], &["none of SLURM_ARRAY_TASK_ID, AWS_BATCH_JOB_ARRAY_INDEX, LSB_JOBINDEX, SGE_TASK_ID"]);
}

#[test]
fn ranks_of_mpi_are_shares() {
    is(
        &[("OMPI_COMM_WORLD_RANK", "3"), ("OMPI_COMM_WORLD_SIZE", "4"), ("PMIX_RANK", "3")],
        "4/4",
        &["OMPI_COMM_WORLD_RANK=3", "OMPI_COMM_WORLD_SIZE=4"],
    );
    is(&[("PMI_RANK", "0"), ("PMI_SIZE", "2")], "1/2", &["PMI_RANK=0", "PMI_SIZE=2"]);
    refused(&[("PMIX_RANK", "1")], &["PMIX_RANK is set, and OMPI_COMM_WORLD_SIZE or PMI_SIZE"]);
    is(&[("PMIX_RANK", "1"), ("SLURM_STEP_NUM_TASKS", "3")], "2/3", &["PMIX_RANK=1", "SLURM_STEP_NUM_TASKS=3"]);
    refused(&[("OMPI_COMM_WORLD_RANK", "1")], &["OMPI_COMM_WORLD_SIZE is not"]);
    refused(&[("PMI_RANK", "2"), ("PMI_SIZE", "2")], &["PMI_RANK is beyond the last of 2 jobs"]);
    // Two that agree are one.
    let both = [("OMPI_COMM_WORLD_RANK", "1"), ("OMPI_COMM_WORLD_SIZE", "4"), ("PMI_RANK", "1"), ("PMI_SIZE", "4")];
    assert_eq!(of(&both).unwrap().0, "2/4");
    let differ = [("OMPI_COMM_WORLD_RANK", "1"), ("OMPI_COMM_WORLD_SIZE", "4"), ("PMI_RANK", "0"), ("PMI_SIZE", "1")];
    refused(&differ, &["different ranks", "OMPI_COMM_WORLD_RANK=1", "PMI_RANK=0"]);
}

/// The script of a job has the number of tasks too, and is one process alone.
#[test]
fn tasks_of_srun_are_shares_and_scripts_are_not() {
    is(&[("SLURM_PROCID", "2"), ("SLURM_NTASKS", "4")], "3/4", &["SLURM_PROCID=2", "SLURM_NTASKS=4"]);
    let task = |step: (&'static str, &'static str)| {
        [("SLURM_JOB_ID", "77"), ("SLURM_PROCID", "0"), ("SLURM_NTASKS", "4"), step]
    };
    assert_eq!(of(&task(("SLURM_STEP_ID", "0"))).unwrap().0, "1/4");
    refused(&task(("SHELL", "sh")), &["this is its script, expected `srun idmesh batch`", "SLURM_NTASKS=4"]);
    // A step may have fewer tasks than the job.
    let step = [&task(("SLURM_STEP_ID", "0"))[..], &[("SLURM_STEP_NUM_TASKS", "2")]].concat();
    assert_eq!(of(&step).unwrap().0, "1/2");
    // An interactive shell of one task names no share.
    refused(&[("SLURM_JOB_ID", "77"), ("SLURM_PROCID", "0"), ("SLURM_NTASKS", "1")], &["none of"]);
    // A launcher of MPI that is itself a task of srun.
    let mpi = [("OMPI_COMM_WORLD_RANK", "5"), ("OMPI_COMM_WORLD_SIZE", "8")];
    assert_eq!(of(&[&task(("SLURM_STEP_ID", "0"))[..], &mpi].concat()).unwrap().0, "6/8");
}

/// Jobs of an array that start ranks have a share for each rank of each job, and no two the same.
#[test]
fn ranks_of_jobs_of_an_array_have_shares_of_their_own() {
    let mut shares = Vec::new();
    for id in ["1", "2", "3"] {
        for rank in ["0", "1"] {
            let ranks = [("OMPI_COMM_WORLD_RANK", rank), ("OMPI_COMM_WORLD_SIZE", "2")];
            shares.push(of(&[&slurm(id, "1", "3", "1", "3")[..], &ranks].concat()).unwrap().0);
        }
    }
    assert_eq!(shares, ["1/6", "2/6", "3/6", "4/6", "5/6", "6/6"]);
    // The script of a job of an array, whatever its number of tasks.
    let script = [("SLURM_JOB_ID", "77"), ("SLURM_PROCID", "0"), ("SLURM_NTASKS", "8")];
    assert_eq!(of(&[&slurm("2", "1", "3", "1", "3")[..], &script].concat()).unwrap().0, "2/3");
}

#[test]
fn two_schedulers_are_ambiguous() {
    let aws = [("AWS_BATCH_JOB_ARRAY_INDEX", "0"), ("AWS_BATCH_JOB_ARRAY_SIZE", "3")];
    let both = [&slurm("2", "1", "3", "1", "3")[..], &aws].concat();
    refused(&both, &["several schedulers", "SLURM_ARRAY_TASK_ID=2", "AWS_BATCH_JOB_ARRAY_INDEX=0"]);
}
