//! The places of airfoils in a case.

use super::*;

/// One airfoil at two places.
#[test]
fn airfoils_may_have_several_places() {
    let places = "[[profiles.wing.placement.\"b.csv\"]]\nchord = 2\nposition = [1, 2, 3]\n\
                  [[profiles.wing.placement.\"b.csv\"]]\nchord = 1\nposition = [1, 4, 3]\n";
    let placed = |places: &str| GOOD.replace("[family.wing]", &format!("{places}[family.wing]"));
    let chords = |text: &str| -> Vec<f64> {
        let case = parse(text).unwrap();
        case.profiles["wing"].placements[Path::new("cases/b.csv")].iter().map(|placement| placement.chord).collect()
    };
    assert_eq!(chords(&placed(places)), [2.0, 1.0]);
    let inline = "placement.\"b.csv\" = [{ chord = 2, position = [1, 2, 3] }, { chord = 1, position = [1, 4, 3] }]\n";
    assert_eq!(chords(&placed(inline)), [2.0, 1.0]);
    let (position, message) = mistake(&placed(&places.replacen("chord = 1", "chrod = 1", 1)));
    assert!(message.contains("unknown key `chrod`") && position.line == 11, "{message} {position:?}");
    let (_, message) = mistake(&placed("placement.\"b.csv\" = []\n"));
    assert!(message.contains("is an empty list, expected at least one table"), "{message}");
    let (_, message) = mistake(&placed("placement.\"b.csv\" = [3]\n"));
    assert!(message.contains("is a number, expected a table"), "{message}");
}

#[test]
fn airfoils_have_a_place() {
    let placed = |keys: &str| {
        GOOD.replace("[family.wing]", &format!("[profiles.wing.placement.\"b.csv\"]\n{keys}\n[family.wing]"))
    };
    let case = parse(&placed("chord = 2\ntwist = -1.5\nposition = [1, 2.5, -3]\nplane = \"z\"")).unwrap();
    let placement = &case.profiles["wing"].placements[Path::new("cases/b.csv")][0];
    assert_eq!((placement.chord, placement.twist, placement.span), (2.0, -1.5, SpanAxis::Z));
    assert_eq!(placement.position, DVec3::new(1.0, 2.5, -3.0));
    let case = parse(&placed("chord = 2\nposition = [1, 2.5, -3]")).unwrap();
    let placement = &case.profiles["wing"].placements[Path::new("cases/b.csv")][0];
    assert_eq!((placement.twist, placement.span), (0.0, SpanAxis::Y));
    for (keys, line, expected) in [
        ("position = [1, 2, 3]", 7, "missing key `chord` in [profiles.wing.placement.b.csv]"),
        ("chord = 2", 7, "missing key `position` in"),
        ("chord = 0\nposition = [1, 2, 3]", 8, "`chord` is 0, expected a length above 0"),
        ("chord = 2\nposition = [1, 2]", 9, "is expected to hold three numbers"),
        ("chord = 2\nposition = [1, inf, 2]", 9, "holds inf, expected finite numbers"),
        ("chord = 2\nposition = 3", 9, "is a number, expected three numbers"),
        ("chord = 2\nposition = [1, 2, 3]\ntwist = nan", 10, "`twist` is NaN, expected degrees, nose up"),
        ("chord = 2\nposition = [1, 2, 3]\nplane = \"x\"", 10, "is \"x\", expected `y` or `z`"),
        ("chrod = 2", 8, "unknown key `chrod`"),
    ] {
        let (position, message) = mistake(&placed(keys));
        assert!(message.contains(expected), "{message}");
        assert_eq!(position.line, line, "{message}");
    }
    let (_, message) =
        mistake(&placed("chord = 2\nposition = [1, 2, 3]").replace("\"b.csv\"]\nchord", "\"c.csv\"]\nchord"));
    assert!(message.contains("a placement is given for \"c.csv\", which is none of the profile files"), "{message}");
}
