//! Frequent slips, and the advice that a message gives.

use super::*;

/// A text without quotes is a frequent slip, and TOML's own words for it lead elsewhere.
#[test]
fn texts_without_quotes_are_told() {
    let advice = |to: &str| mistake(&GOOD.replacen("mesh = \"wing-body.msh\"", to, 1)).1;
    for (value, quoted) in [
        ("new.csv", "\"new.csv\""),
        ("./new/a.csv # mine", "\"./new/a.csv\""),
        ("naca.dat", "\"naca.dat\""),
        ("in_2.csv", "\"in_2.csv\""),
        ("[\"a.csv\", b.csv]", "\"b.csv\""),
        ("[\n  b.csv,\n]", "\"b.csv\""),
    ] {
        let message = advice(&format!("mesh = {value}"));
        assert!(message.ends_with(&format!("; a text needs quotes: {quoted}")), "{message}");
    }
    let curly = advice("mesh = \u{201c}wing.msh\u{201d}");
    assert!(curly.ends_with("; a text needs straight quotes: \"wing.msh\""), "{curly}");
    let path = advice("mesh = \"C:\\meshes\\a.msh\"");
    assert!(path.contains("a backslash begins an escape"), "{path}");
    for other in ["mesh = 1.2.3", "mesh", "[mesh", "mesh = \"a.msh", "[[family.x]"] {
        let message = advice(other);
        assert!(!message.contains("needs"), "{other}: {message}");
    }
}

/// Words of other programs lead to the roles that they may mean.
#[test]
fn words_of_others_lead_to_roles() {
    for (word, meant) in [
        ("symmetry", "`plane`?"),
        ("Farfield", "`fixed`?"),
        ("far-field", "`fixed`?"),
        ("tip", "`wingtip`?"),
        ("TE", "`trailing-edge`?"),
        ("body", "`carenage`?"),
        ("wall", "`wing`, `carenage` or `fixed`?"),
        ("slip", "`carenage`, `plane` or `fixed`?"),
        ("wign", "`wing`?"),
    ] {
        let (_, message) = mistake(&GOOD.replacen("role = \"fixed\"", &format!("role = \"{word}\""), 1));
        assert!(message.ends_with(&format!("did you mean {meant}")), "{message}");
        assert_eq!(message.matches("did you mean").count(), 1, "{message}");
    }
    let (_, message) = mistake(&GOOD.replacen("role = \"fixed\"", "role = \"zzz\"", 1));
    assert!(!message.contains("did you mean"), "{message}");
}
