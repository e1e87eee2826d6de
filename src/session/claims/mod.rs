//! A folder of claims, through which several processes share the designs of a batch.
//!
//! A process claims a design before it moves the mesh to the design. A claim is a file
//! `DESIGN.GENERATION.claim`:
//!
//! | what happens | how |
//! |---|---|
//! | a process claims a free design | it makes the file of generation 1, which one process alone can |
//! | a holder works | a thread renews the claim: it changes the time of the file |
//! | a holder ends a design | the file says that the design is done, with its result |
//! | a holder fails for another reason | the file says that the design is free |
//! | a holder ends by a signal | its computer knows by the process's number, others see that the claim is renewed no more |
//! | a process takes a design over | it makes the file of the next generation, which one process alone can |
//! | a holder stood still, and its claim was taken over | it sees the next generation before it writes results, and leaves these to the new holder |
//!
//! A file that holds no claim, also a pipe, counts as a claim that is renewed no more.
//!
//! No file of a claim is ever removed: a process that removed an old claim could not know whether
//! it removes a new one. Only the last generation of a design counts.

mod file;
mod held;
mod purpose;
mod record;
mod silence;

use std::borrow::Cow;
use std::collections::{HashMap, VecDeque};
use std::fs::{self, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

pub use held::Held;
use held::{Renewer, is_in_hand};
pub use record::Done;
use record::{Holder, Record, State, now};
use silence::{Sign, Silence};

use super::ClaimError;
use super::checksums::{same_files, same_outputs, sums};
use super::earlier::has_result;
use super::files::cannot_write;
use super::{DesignFiles, Folder, Outputs, SessionError};
use crate::formats::{open_file, read_file, sha256_of_text};
use crate::report::Checksums;

/// Largest number of bytes in the name of a file.
const NAME: usize = 255;

/// Largest number of bytes behind a design's name in the name of a claim's file.
const BEHIND: usize = ".4294967295.claim".len();

/// Most bytes of a claim's file that are read.
const MOST: u64 = 1 << 24;

/// Claims of later generations are no work of idmesh.
const MOST_GENERATIONS: u32 = 1_000_000_000;

/// A design with which so many jobs ended is given up: it may be the design that ends them.
const GIVEN_UP: u32 = 5;

/// Number of the next claim of this process.
static SERIAL: AtomicU64 = AtomicU64::new(0);

/// How a job shares its designs.
#[derive(Clone, Copy, Debug)]
pub struct Claiming {
    /// A claim of this job expires if it was not renewed for so long.
    pub expires: Duration,
    /// Whether designs that are done are done again if their files or results have changed since,
    /// or if they could not be moved.
    pub resumes: bool,
}

/// The claims of a batch.
#[derive(Debug)]
pub struct Claims<'d> {
    path: PathBuf,
    designs: &'d [DesignFiles],
    claiming: Claiming,
    renewer: Renewer,
    state: Mutex<Designs>,
    _folder: Folder,
}

/// What is known of the designs, by their places.
#[derive(Debug, Default)]
struct Designs {
    /// Designs without a claim, as far as is known.
    free: VecDeque<usize>,
    /// Designs that are in other hands, or may be taken over.
    others: Vec<usize>,
    /// The last generation that was seen. Missing if none was.
    generations: HashMap<usize, u32>,
    /// Generations of designs that were done before this process began and are to be done again.
    again: HashMap<usize, u32>,
    /// Whether each design that is done failed.
    done: HashMap<usize, bool>,
    silence: Silence,
}

/// The next piece of work.
#[derive(Debug)]
pub enum Next {
    /// A design, by its place among the designs, and its claim.
    Design(usize, Box<Held>),
    /// All designs that are not done are in other hands.
    Wait,
    /// All designs are done, or this process works on the others.
    Finished,
}

/// A claim as it is found.
struct Found {
    generation: u32,
    path: PathBuf,
    /// `None` if the file holds no claim.
    record: Option<Record>,
    sign: Sign,
}

impl<'d> Claims<'d> {
    /// Opens a folder of claims, which is made if it is missing, and finds out what is done.
    ///
    /// - `designs`: the designs of this job
    /// - `case`: checksums of the case's files
    /// - `pattern`: the outputs of the case, to which a design gives its name
    ///
    /// # Errors
    /// The folder takes no files, it is for another batch, or a design was claimed with other
    /// contents.
    pub fn open(
        path: &Path,
        designs: &'d [DesignFiles],
        case: &Checksums,
        pattern: &Outputs,
        claiming: Claiming,
    ) -> Result<Self, SessionError> {
        let folder = Folder::make(path)?;
        super::check_writable(&path.join(purpose::NAME))?;
        purpose::check(path, case, pattern)?;
        let renewer = Renewer::start(claiming.expires).map_err(|error| cannot_write(path, error))?;
        let claims =
            Self { path: path.to_path_buf(), designs, claiming, renewer, state: Mutex::default(), _folder: folder };
        let seen = claims.generations()?;
        let mut state = Designs::default();
        for (index, design) in designs.iter().enumerate() {
            let Some(&generation) = seen.get(&*claim_name(&design.name)) else {
                state.free.push_back(index);
                continue;
            };
            state.generations.insert(index, generation);
            match claims.find(&mut state, index)? {
                Some(found) if claims.is_to_be_done_again(index, &found, pattern)? => {
                    state.again.insert(index, found.generation);
                    state.others.push(index);
                }
                Some(Found { record: Some(Record { state: State::Done(done), .. }), .. }) => {
                    state.done.insert(index, done.exit != 0);
                }
                _ => state.others.push(index),
            }
        }
        *claims.state.lock().unwrap_or_else(PoisonError::into_inner) = state;
        Ok(claims)
    }

    /// The last generation of each design's claim in the folder, by the name before the generation.
    fn generations(&self) -> Result<HashMap<String, u32>, SessionError> {
        let unreadable = |source| SessionError::CannotRead { path: self.path.clone(), source };
        let mut seen = HashMap::new();
        for entry in fs::read_dir(&self.path).map_err(unreadable)? {
            let name = entry.map_err(unreadable)?.file_name();
            let of_claim = name.to_str().and_then(|name| name.strip_suffix(".claim")?.rsplit_once('.'));
            let Some((design, Ok(generation @ 1..=MOST_GENERATIONS))) =
                of_claim.map(|(design, number)| (design, number.parse::<u32>()))
            else {
                continue;
            };
            let last = seen.entry(design.to_owned()).or_insert(0);
            *last = generation.max(*last);
        }
        Ok(seen)
    }

    /// Whether a design that is marked as done is done again: its outputs are missing; or, if this
    /// job resumes, its files or outputs have changed or it could not be moved.
    fn is_to_be_done_again(&self, index: usize, found: &Found, pattern: &Outputs) -> Result<bool, SessionError> {
        let Some(Record { state: State::Done(done), sums: of_record, .. }) = &found.record else { return Ok(false) };
        let design = &self.designs[index];
        let has_changed = !same_files(of_record, &sums(design.paths()));
        if has_changed && !self.claiming.resumes {
            return Err(ClaimError::OtherDesign { design: design.name.clone(), path: found.path.clone() }.into());
        }
        let has_result = has_result(done.exit);
        let outputs = pattern.named(&design.name)?;
        Ok(match self.claiming.resumes {
            true => has_changed || !has_result || !same_outputs(&done.outputs, &outputs, done.valid),
            // A mesh without finite positions has no files.
            false => !done.outputs.is_empty() && !outputs.names_of(done.valid).iter().all(|path| path.exists()),
        })
    }

    /// Claims the next design.
    ///
    /// # Errors
    /// The folder takes no files, or a design was claimed with other contents.
    pub fn next(&self) -> Result<Next, SessionError> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        while let Some(index) = state.free.pop_front() {
            match self.claim(index, 1, 0)? {
                Some(held) => {
                    state.generations.insert(index, 1);
                    return Ok(Next::Design(index, Box::new(held)));
                }
                None => state.others.push(index),
            }
        }
        let mut claimed = None;
        for index in std::mem::take(&mut state.others) {
            if claimed.is_some() {
                state.others.push(index);
                continue;
            }
            match self.judge(&mut state, index)? {
                Verdict::Done(failed) => {
                    state.done.insert(index, failed);
                }
                Verdict::Free(generation, ended) => match self.claim(index, generation, ended)? {
                    Some(held) => {
                        state.generations.insert(index, generation);
                        claimed = Some(Next::Design(index, Box::new(held)));
                    }
                    None => state.others.push(index),
                },
                Verdict::InOtherHands => state.others.push(index),
            }
        }
        Ok(claimed.unwrap_or(if state.others.is_empty() { Next::Finished } else { Next::Wait }))
    }

    /// Marks a design as done.
    ///
    /// - `index`: place of the design
    /// - `done`: its result
    ///
    /// # Errors
    /// The claim's file cannot be written.
    pub fn done(&self, index: usize, held: Held, done: Done) -> Result<(), SessionError> {
        let failed = done.exit != 0;
        held.done(done)?;
        self.state.lock().unwrap_or_else(PoisonError::into_inner).done.insert(index, failed);
        Ok(())
    }

    /// Leaves a design to the process that has taken it over.
    pub fn lost(&self, index: usize, held: Held) {
        held.lost();
        self.state.lock().unwrap_or_else(PoisonError::into_inner).others.push(index);
    }

    /// The number of designs that are done, and how many of them failed.
    pub fn n_done_and_failed(&self) -> (usize, usize) {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        (state.done.len(), state.done.values().filter(|failed| **failed).count())
    }

    /// The designs that are in other hands, with their holders in words.
    pub fn in_other_hands(&self) -> Vec<(String, String)> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let holder = |record: &Record| format!("process {} on {}", record.holder.process, record.holder.host);
        let others = state.others.clone();
        let mut words = |index: usize| {
            let found = self.find(&mut state, index).ok().flatten();
            found
                .and_then(|found| found.record)
                .map_or_else(|| "an unknown process".to_owned(), |record| holder(&record))
        };
        others.into_iter().map(|index| (self.designs[index].name.clone(), words(index))).collect()
    }

    /// Makes the claim of a generation; `None` if another process has it.
    fn claim(&self, index: usize, generation: u32, ended: u32) -> Result<Option<Held>, SessionError> {
        let design = &self.designs[index];
        let path = self.file(index, generation);
        let record = Record {
            design: design.name.clone(),
            sums: sums(design.paths()),
            state: State::Held,
            holder: Holder::this().clone(),
            serial: SERIAL.fetch_add(1, Relaxed),
            time: now(),
            expires: self.claiming.expires.as_secs(),
            ended,
        };
        let text = serde_json::to_string(&record)? + "\n";
        let made = file::make(&path, text.as_bytes()).map_err(|error| cannot_write(&path, error))?;
        let file = match made {
            Some(file) => file,
            // A file server may say that the file was there before, because it was asked twice.
            None if read_file(&path).is_ok_and(|bytes| bytes == text.as_bytes()) => {
                match File::options().read(true).write(true).open(&path) {
                    Ok(file) => file,
                    Err(_) => return Ok(None),
                }
            }
            None => return Ok(None),
        };
        let next = self.file(index, generation + 1);
        Ok(Some(Held::new([path, next], generation == 1, record, file, &self.renewer.renewals)))
    }

    /// What is to be done with a design that has a claim.
    fn judge(&self, state: &mut Designs, index: usize) -> Result<Verdict, SessionError> {
        let Some(found) = self.find(state, index)? else { return Ok(Verdict::Free(1, 0)) };
        let Found { generation, path, record, sign } = found;
        let next = generation + 1;
        if state.again.get(&index) == Some(&generation) {
            return Ok(Verdict::Free(next, 0));
        }
        let Some(record) = record else {
            // Half a claim, or none. Its maker may still be at work on it.
            let expired = state.silence.is_expired(index, sign, self.claiming.expires, Instant::now());
            return Ok(if expired { Verdict::Free(next, 1) } else { Verdict::InOtherHands });
        };
        let design = &self.designs[index];
        if record.design != design.name || !same_files(&record.sums, &sums(design.paths())) {
            return Err(ClaimError::OtherDesign { design: design.name.clone(), path }.into());
        }
        Ok(match record.state {
            State::Done(done) => Verdict::Done(done.exit != 0),
            State::Released => Verdict::Free(next, record.ended),
            State::Held if record.holder == *Holder::this() => match is_in_hand(record.serial) {
                true => Verdict::InOtherHands,
                // Given up because it seemed lost.
                false => Verdict::Free(next, record.ended),
            },
            State::Held => {
                let expires = Duration::from_secs(record.expires);
                let expired =
                    record.holder.has_ended() || state.silence.is_expired(index, sign, expires, Instant::now());
                if expired { Verdict::Free(next, record.ended.saturating_add(1)) } else { Verdict::InOtherHands }
            }
        })
    }

    /// Finds the last claim of a design; `None` if there is none.
    fn find(&self, state: &mut Designs, index: usize) -> Result<Option<Found>, SessionError> {
        let mut generation = state.generations.get(&index).copied().unwrap_or(0);
        if generation > 0 && fs::symlink_metadata(self.file(index, generation)).is_err() {
            // Somebody has removed claims.
            generation = 0;
        }
        while fs::symlink_metadata(self.file(index, generation + 1)).is_ok() {
            generation += 1;
        }
        state.generations.insert(index, generation);
        if generation == 0 {
            return Ok(None);
        }
        let path = self.file(index, generation);
        let read = || {
            // A pipe or a device holds no claim, and to read it might never end.
            let (file, _) = open_file(&path)?;
            Ok((contents(&file)?, file.metadata()?.modified().ok()))
        };
        // What cannot be read now, such as a file that is replaced on a file server, may be read
        // later.
        let (contents, modified) = read().unwrap_or_else(|_: io::Error| (Vec::new(), None));
        let record = serde_json::from_slice(&contents).ok();
        Ok(Some(Found { generation, path, record, sign: Sign { generation, modified, contents } }))
    }

    fn file(&self, index: usize, generation: u32) -> PathBuf {
        self.path.join(format!("{}.{generation}.claim", claim_name(&self.designs[index].name)))
    }
}

/// The name of a design's claims before the generation: the design's own, or its beginning and its
/// checksum if a file's name has no room for all of it.
fn claim_name(design: &str) -> Cow<'_, str> {
    if design.len() + BEHIND <= NAME {
        return design.into();
    }
    let sum = sha256_of_text(design);
    let mut end = NAME - BEHIND - sum.len() - 1;
    while !design.is_char_boundary(end) {
        end -= 1;
    }
    format!("{}~{sum}", &design[..end]).into()
}

/// What is to be done with a design that has a claim.
#[derive(Debug, PartialEq, Eq)]
enum Verdict {
    /// The design is done; whether it failed.
    Done(bool),
    /// The design may be claimed in this generation, after so many holders that ended.
    Free(u32, u32),
    InOtherHands,
}

fn contents(file: &File) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    file.take(MOST).read_to_end(&mut bytes)?;
    Ok(bytes)
}

impl Held {
    /// The error of a design that several jobs could not end.
    pub fn given_up(&self) -> Option<ClaimError> {
        let times = self.ended();
        (times >= GIVEN_UP).then(|| ClaimError::GivenUp { times, path: self.path().to_path_buf() })
    }
}
