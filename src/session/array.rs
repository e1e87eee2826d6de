//! [`ArrayJob`]: the share of a job by the variables that a scheduler or an MPI launcher sets.
//!
//! | level | set by | variables |
//! |---|---|---|
//! | array | SLURM | `SLURM_ARRAY_TASK_ID`, `_MIN`, `_MAX`, `_STEP`, `_COUNT` |
//! | | AWS Batch | `AWS_BATCH_JOB_ARRAY_INDEX` from 0, `AWS_BATCH_JOB_ARRAY_SIZE` |
//! | | LSF | `LSB_JOBINDEX` from 1 (0 outside an array), `LSB_JOBINDEX_END`, `LSB_JOBINDEX_STEP` |
//! | | SGE | `SGE_TASK_ID` ("undefined" outside an array), `SGE_TASK_FIRST`, `_LAST`, `_STEPSIZE` |
//! | | PBS | `PBS_ARRAY_INDEX` or `PBS_ARRAYID`, without a number of jobs |
//! | ranks | Open MPI | `OMPI_COMM_WORLD_RANK`, `OMPI_COMM_WORLD_SIZE` |
//! | | MPICH, Intel MPI | `PMI_RANK`, `PMI_SIZE` |
//! | | PMIx | `PMIX_RANK`, with the size of another set |
//! | | `srun` | `SLURM_PROCID`, `SLURM_STEP_NUM_TASKS` or `SLURM_NTASKS` |
//!
//! Where there are an array and ranks, every job of the array starts all ranks, and each rank of
//! each job has a share of its own. A wrong guess would leave designs out in silence. So what is
//! incomplete, or can be meant in two ways, is an error.

use thiserror::Error;

use super::Shard;

/// A job of an array, a rank, or a rank of a job of an array.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ArrayJob {
    /// The share of the designs.
    pub shard: Shard,
    /// The variables that say so, as `NAME=VALUE`.
    pub from: Vec<String>,
}

/// Variables that name no share.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[non_exhaustive]
pub enum ArrayError {
    /// No variable is set.
    #[error(
        "no share of the designs is known: none of {} is set",
        ["SLURM_ARRAY_TASK_ID", "AWS_BATCH_JOB_ARRAY_INDEX", "LSB_JOBINDEX", "SGE_TASK_ID", "OMPI_COMM_WORLD_RANK",
         "PMI_RANK", "SLURM_PROCID"].join(", ")
    )]
    None,
    /// The variables do not say the share.
    #[error("no share of the designs is known from {}: {why}", seen.join(", "))]
    Unclear {
        /// The variables that are set, as `NAME=VALUE`.
        seen: Vec<String>,
        /// What is missing or wrong.
        why: String,
    },
}

impl ArrayError {
    /// A remedy that the user may try.
    pub fn hint(&self) -> &'static str {
        "--shard I/N names the share: with PBS and `qsub -J 1-10` it is --shard $PBS_ARRAY_INDEX/10"
    }
}

/// Reads variables, and keeps those that are set.
struct Variables<'g> {
    get: &'g dyn Fn(&str) -> Option<String>,
    seen: Vec<String>,
}

/// A place among several, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Place {
    index: u64,
    of: u64,
}

/// A place with the variables that say so.
type Named = (Place, Vec<String>);

impl Variables<'_> {
    fn text(&mut self, name: &str) -> Option<String> {
        let value = (self.get)(name)?;
        let seen = format!("{name}={value}");
        if !self.seen.contains(&seen) {
            self.seen.push(seen);
        }
        Some(value.trim().to_owned())
    }

    fn unclear<T>(&self, why: impl Into<String>) -> Result<T, ArrayError> {
        Err(ArrayError::Unclear { seen: self.seen.clone(), why: why.into() })
    }

    /// A number; `None` if the variable is not set.
    fn number(&mut self, name: &str) -> Result<Option<u64>, ArrayError> {
        match self.text(name).map(|text| text.parse().map_err(|_| text)) {
            None => Ok(None),
            Some(Ok(number)) => Ok(Some(number)),
            Some(Err(text)) => self.unclear(format!("{name} is \"{text}\", expected a whole number from 0 on")),
        }
    }

    /// A number that must be set beside another variable.
    fn beside(&mut self, first: &str, name: &str) -> Result<u64, ArrayError> {
        match self.number(name)? {
            Some(number) => Ok(number),
            None => self.unclear(format!("{first} is set, and {name} is not")),
        }
    }

    fn place(&self, index: u64, of: u64, what: &str) -> Result<Place, ArrayError> {
        if index < of {
            Ok(Place { index, of })
        } else {
            self.unclear(format!("{what} is beyond the last of {of} jobs"))
        }
    }

    /// The place of a number in a series with a step.
    fn in_series(&self, what: &str, [id, first, last, step]: [u64; 4]) -> Result<Place, ArrayError> {
        if step == 0 || id < first || id > last || (id - first) % step != 0 {
            return self.unclear(format!("{what} is not in the series from {first} to {last} in steps of {step}"));
        }
        self.place((id - first) / step, (last - first) / step + 1, what)
    }

    fn slurm_array(&mut self) -> Result<Option<Place>, ArrayError> {
        const ID: &str = "SLURM_ARRAY_TASK_ID";
        let Some(id) = self.number(ID)? else { return Ok(None) };
        let count = self.beside(ID, "SLURM_ARRAY_TASK_COUNT")?;
        let first = self.beside(ID, "SLURM_ARRAY_TASK_MIN")?;
        let last = match self.number("SLURM_ARRAY_TASK_MAX")? {
            Some(last) => last,
            None => first.saturating_add(count.saturating_sub(1)),
        };
        let step = match self.number("SLURM_ARRAY_TASK_STEP")? {
            Some(step) => step,
            None if count > 1 => last.saturating_sub(first) / (count - 1),
            None => 1,
        };
        let place = self.in_series(ID, [id, first, last, step])?;
        // A list such as 1,3,7 has gaps that no variable tells.
        match place.of == count {
            true => Ok(Some(place)),
            false => self.unclear(format!("{count} jobs are no series, expected an array such as 1-{count}")),
        }
    }

    fn aws_batch(&mut self) -> Result<Option<Place>, ArrayError> {
        const INDEX: &str = "AWS_BATCH_JOB_ARRAY_INDEX";
        let Some(index) = self.number(INDEX)? else { return Ok(None) };
        let of = self.beside(INDEX, "AWS_BATCH_JOB_ARRAY_SIZE")?;
        self.place(index, of, INDEX).map(Some)
    }

    fn lsf(&mut self) -> Result<Option<Place>, ArrayError> {
        const INDEX: &str = "LSB_JOBINDEX";
        // A job that is no array has the index 0.
        if (self.get)(INDEX).is_none_or(|index| index.trim() == "0") {
            return Ok(None);
        }
        let Some(index) = self.number(INDEX)? else { return Ok(None) };
        let last = self.beside(INDEX, "LSB_JOBINDEX_END")?;
        let step = self.number("LSB_JOBINDEX_STEP")?.unwrap_or(1);
        self.in_series(INDEX, [index, 1, last, step]).map(Some)
    }

    fn sge(&mut self) -> Result<Option<Place>, ArrayError> {
        const ID: &str = "SGE_TASK_ID";
        if (self.get)(ID).is_none_or(|id| id.trim() == "undefined") {
            return Ok(None);
        }
        let Some(id) = self.number(ID)? else { return Ok(None) };
        let first = self.beside(ID, "SGE_TASK_FIRST")?;
        let last = self.beside(ID, "SGE_TASK_LAST")?;
        let step = self.number("SGE_TASK_STEPSIZE")?.unwrap_or(1);
        self.in_series(ID, [id, first, last, step]).map(Some)
    }

    fn pbs(&mut self) -> Result<Option<Place>, ArrayError> {
        for name in ["PBS_ARRAY_INDEX", "PBS_ARRAYID"] {
            if self.text(name).is_some() {
                return self.unclear("PBS does not tell the number of jobs, expected --shard I/N");
            }
        }
        Ok(None)
    }

    /// A rank and the number of ranks.
    fn ranks(&mut self, rank: &str, sizes: &[&str]) -> Result<Option<Place>, ArrayError> {
        let Some(index) = self.number(rank)? else { return Ok(None) };
        for size in sizes {
            if let Some(of) = self.number(size)? {
                return self.place(index, of, rank).map(Some);
            }
        }
        self.unclear(format!("{rank} is set, and {} is not", sizes.join(" or ")))
    }

    fn srun(&mut self) -> Result<Option<Place>, ArrayError> {
        const RANK: &str = "SLURM_PROCID";
        let sizes = ["SLURM_STEP_NUM_TASKS", "SLURM_NTASKS"];
        let is_set = |name: &str| (self.get)(name).is_some();
        let is_of_array = is_set("SLURM_ARRAY_TASK_ID");
        // The script of a job is process 0 too, and the only one, whatever the number of tasks.
        if is_set("SLURM_JOB_ID") && !is_set("SLURM_STEP_ID") && !is_set("SLURM_STEPID") {
            return match self.number("SLURM_NTASKS")? {
                Some(2..) if !is_of_array => {
                    self.text(RANK);
                    self.text("SLURM_JOB_ID");
                    self.unclear("the job has several tasks, and this is its script, expected `srun idmesh batch`")
                }
                _ => Ok(None),
            };
        }
        match is_of_array && !sizes.iter().any(|size| is_set(size)) {
            true => Ok(None),
            false => self.ranks(RANK, &sizes),
        }
    }

    /// Runs a reader, and keeps the variables that it reads apart.
    fn named(
        &mut self,
        read: impl FnOnce(&mut Self) -> Result<Option<Place>, ArrayError>,
    ) -> Result<Option<Named>, ArrayError> {
        let before = std::mem::take(&mut self.seen);
        let place = read(self)?;
        let own = std::mem::replace(&mut self.seen, before);
        if place.is_some() {
            self.seen.extend(own.iter().cloned());
        }
        Ok(place.map(|place| (place, own)))
    }

    /// The place in an array of jobs.
    fn array(&mut self) -> Result<Option<Named>, ArrayError> {
        let readers = [Self::slurm_array, Self::aws_batch, Self::lsf, Self::sge, Self::pbs];
        let mut found: Option<Named> = None;
        for reader in readers {
            if let Some(named) = self.named(reader)? {
                if found.is_some() {
                    return self.unclear("several schedulers name a job of an array");
                }
                found = Some(named);
            }
        }
        Ok(found)
    }

    /// The place among the ranks of MPI, or among the tasks that `srun` started.
    fn rank(&mut self) -> Result<Option<Named>, ArrayError> {
        let open_mpi = self.named(|all| all.ranks("OMPI_COMM_WORLD_RANK", &["OMPI_COMM_WORLD_SIZE"]))?;
        let pmi = self.named(|all| all.ranks("PMI_RANK", &["PMI_SIZE"]))?;
        if let (Some((one, _)), Some((other, _))) = (&open_mpi, &pmi)
            && one != other
        {
            return self.unclear("two launchers of MPI name different ranks");
        }
        if let Some(named) = open_mpi.or(pmi) {
            // A launcher of MPI may itself be a task of `srun`, whose numbers are others.
            return Ok(Some(named));
        }
        let srun = self.named(Self::srun)?;
        if srun.is_some() || (self.get)("PMIX_RANK").is_none() {
            return Ok(srun);
        }
        self.named(|all| all.ranks("PMIX_RANK", &["OMPI_COMM_WORLD_SIZE", "PMI_SIZE", "SLURM_STEP_NUM_TASKS"]))
    }
}

impl ArrayJob {
    /// The share of this job by its variables.
    ///
    /// - `get`: the value of a variable; `None` if it is not set
    ///
    /// # Errors
    /// No variable is set, some are missing or no numbers, or they can be meant in two ways.
    pub fn of_variables(get: impl Fn(&str) -> Option<String>) -> Result<Self, ArrayError> {
        let mut variables = Variables { get: &get, seen: Vec::new() };
        let levels = [variables.array()?, variables.rank()?];
        let (mut whole, mut from) = (Place { index: 0, of: 1 }, Vec::new());
        for (place, names) in levels.into_iter().flatten() {
            let inner = |number: u64| number.checked_mul(place.of);
            let joined = inner(whole.index).and_then(|index| Some((index.checked_add(place.index)?, inner(whole.of)?)));
            let Some((index, of)) = joined else { return variables.unclear("too many jobs") };
            whole = Place { index, of };
            from.extend(names);
        }
        if from.is_empty() {
            return Err(ArrayError::None);
        }
        match Shard::of_job(whole.index, whole.of) {
            Some(shard) => Ok(Self { shard, from }),
            None => variables.unclear("too many jobs"),
        }
    }
}

#[cfg(test)]
mod tests;
