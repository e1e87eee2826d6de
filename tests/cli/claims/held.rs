//! Claims in the hands of a program that uses the library.

use super::*;

/// The claims of a library's user, who has the case, the designs and the outputs.
fn with_claims<T>(
    fixture: &Fixture,
    expires: u64,
    work: impl FnOnce(&LoadedCase, &[DesignFiles], &Outputs, &Claims) -> T,
) -> T {
    let case = Case::load(fixture.path("case.toml")).unwrap();
    let listed = list_designs(&fixture.path("designs"), &["csv"], &["wing".to_owned()]).unwrap();
    let outputs = Outputs::of(&case.case, None);
    let claiming = Claiming { expires: Duration::from_secs(expires), resumes: false };
    let folder = fixture.path("claims");
    let claims = Claims::open(&folder, &listed.designs, &sums_of_case(&case), &outputs, claiming).unwrap();
    work(&case, &listed.designs, &outputs, &claims)
}

#[track_caller]
fn next(claims: &Claims) -> (usize, Held) {
    match claims.next().unwrap() {
        Next::Design(index, held) => (index, *held),
        other => panic!("{other:?}"),
    }
}

/// A job that stood still while another one took its design over leaves the result to that job.
///
/// Fails if the claim is not checked before files get their names.
#[test]
fn a_job_that_lost_its_claim_writes_nothing() {
    let fixture = designs(2);
    with_claims(&fixture, 100, |case, designs, outputs, claims| {
        let mut session = Session::new(case, select(Selection::Cpu).unwrap(), |_| {}).unwrap();
        let mut finish = |index: usize, held: &Held| {
            let outputs = outputs.named(&designs[index].name).unwrap();
            let finished = session.finish(Job {
                design: &case.design,
                name: Some(&designs[index].name),
                started: Instant::now(),
                read_seconds: 0.0,
                outputs: &outputs,
                report: None,
                checksums: None,
                claim: Some(held),
            });
            finished.map(|finished| finished.written.len())
        };
        let (index, held) = next(claims);
        fixture.write("claims/000.2.claim", "");
        fixture.write("000.msh", "of the other job");
        let error = finish(index, &held).unwrap_err().to_string();
        assert!(error.contains("another job has taken the design over") && error.contains("000.1.claim"), "{error}");
        assert_eq!(fixture.read("000.msh"), "of the other job");
        let (index, other) = next(claims);
        assert_eq!(finish(index, &other).unwrap(), 1);
        assert!(fixture.path("001.msh").exists());
        // A claim that is lost is not given back: its file is the other job's to read.
        let before = fixture.read("claims/000.1.claim");
        claims.lost(0, held);
        assert_eq!(fixture.read("claims/000.1.claim"), before);
        // The removal of a claim loses it too.
        fs::remove_file(fixture.path("claims/001.1.claim")).unwrap();
        assert!(other.check().is_err());
    });
}

/// A job that was stopped, and whose design another one did meanwhile, takes no result away when it
/// goes on. A design that fails leaves no earlier result.
#[test]
fn a_job_that_goes_on_takes_no_result_away() {
    let fixture = designs(3);
    let signal = |job: &Child, signal: &str| {
        std::process::Command::new("kill").args([signal, &job.id().to_string()]).status().unwrap();
    };
    let mut stopped = start(&fixture, &claiming(&["--claim-expires", "1"]));
    while !fixture.path("claims/000.1.claim").exists() {
        assert!(stopped.try_wait().unwrap().is_none());
        std::thread::yield_now();
    }
    signal(&stopped, "-STOP");
    // A job of another computer sees only that the claim is not renewed.
    let path = fixture.path("claims/000.1.claim");
    let record = fs::read_to_string(&path).unwrap();
    let was_held = serde_json::from_str::<Value>(&record).unwrap()["state"] == "held";
    assert_good(&claim(&fixture, &["--claim-expires", "1"]));
    signal(&stopped, "-CONT");
    assert_good(&stopped.wait_with_output().unwrap());
    assert_eq!(files(&fixture.path("moved")).len(), 3);
    assert_eq!(names(&lines(&fixture, "all.jsonl")), all_names(3));
    assert!(!was_held || fixture.path("claims/000.2.claim").exists());

    fixture.write("designs/001.csv", "profile,x,y,z\n0,1,zwei,3\n");
    refused(&claim(&fixture, &["--resume"]), 1, &["error: 1 of 3 designs failed"]);
    assert_eq!(files(&fixture.path("moved")).into_keys().collect::<Vec<_>>(), ["000.msh", "002.msh"]);
}

/// A claim that is dropped before its design is done is free at once, and one that is held is
/// renewed.
#[test]
fn claims_are_given_back_and_renewed() {
    let fixture = designs(1);
    with_claims(&fixture, 1, |_, _, _, claims| {
        let (_, held) = next(claims);
        assert!(matches!(claims.next().unwrap(), Next::Finished));
        let time = || fs::metadata(fixture.path("claims/000.1.claim")).unwrap().modified().unwrap();
        // Another part of the program leaves the design alone too.
        let nothing = with_claims(&fixture, 1, |_, _, _, other| matches!(other.next().unwrap(), Next::Wait));
        assert!(nothing);
        let before = time();
        let looks = (0..6000).find(|_| {
            std::thread::sleep(Duration::from_millis(10));
            time() != before
        });
        assert!(looks.is_some(), "the claim was not renewed");
        drop(held);
        assert_eq!(record(&fixture, "000", 1)["state"], "released");
    });
    with_claims(&fixture, 1, |_, _, _, claims| {
        let (index, held) = next(claims);
        assert_eq!((index, held.ended(), held.is_first()), (0, 0, false));
        assert!(fixture.path("claims/000.2.claim").exists());
        let done = Done { exit: 0, valid: true, outputs: Default::default() };
        claims.done(index, held, done).unwrap();
        assert!(matches!(claims.next().unwrap(), Next::Finished));
        assert_eq!(claims.n_done_and_failed(), (1, 0));
    });
}
