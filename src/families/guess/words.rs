//! What the name of a family says about it.

/// What the words of a name say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Named {
    TrailingEdge,
    Wingtip,
    /// A part that a wing carries, such as a winglet or a pylon.
    Carried,
    /// A body that such a part carries, such as a nacelle.
    Body,
    Fuselage,
    Wing,
    Plane,
    Far,
}

/// Words of names, with the meaning of a name that has one of them. A name with words of several
/// rows has the meaning of the first: `wing_tip` is a wingtip.
const WORDS: [(Named, &[&str]); 8] = [
    (Named::Carried, &["winglet", "sharklet", "fence", "pylon", "strut", "canoe", "fairing"]),
    (Named::Body, &["nacelle", "engine", "store", "pod", "intake", "spinner", "propeller"]),
    (Named::TrailingEdge, &["te", "trailing", "trailingedge", "base", "blunt"]),
    (Named::Wingtip, &["tip", "tips", "wingtip", "tipcap", "cap", "endcap"]),
    (Named::Fuselage, &["fuselage", "carenage", "body", "hull", "fus", "belly", "bellyfairing"]),
    (
        Named::Wing,
        &[
            "wing",
            "wings",
            "mainwing",
            "airfoil",
            "aerofoil",
            "foil",
            "hydrofoil",
            "blade",
            "tail",
            "tailplane",
            "htp",
            "vtp",
            "canard",
            "stabilizer",
            "stabiliser",
            "fin",
            "aile",
            "asa",
            "fluegel",
        ],
    ),
    (Named::Plane, &["symmetry", "sym", "symm", "mirror", "symmetryplane", "periodic", "cyclic"]),
    (
        Named::Far,
        &[
            "farfield",
            "far",
            "freestream",
            "inlet",
            "inflow",
            "outlet",
            "outflow",
            "external",
            "riemann",
            "ff",
            "farf",
            "tunnel",
        ],
    ),
];

/// The words of a name, in small letters: runs of letters, also where a capital letter begins a new
/// word (`TrailingEdge`).
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_small = false;
    for letter in name.chars() {
        if !letter.is_alphabetic() || letter.is_uppercase() && was_small {
            words.push(String::new());
        }
        was_small = letter.is_lowercase();
        if let (true, Some(word)) = (letter.is_alphabetic(), words.last_mut()) {
            word.extend(letter.to_lowercase());
        }
    }
    words.retain(|word| !word.is_empty());
    words
}

/// What a name says, with the word that says it.
pub(super) fn named(name: &str) -> Option<(Named, &'static str)> {
    let words = words(name);
    let known = |&(named, list): &(Named, &'static [&'static str])| {
        list.iter().find(|&&known| words.iter().any(|word| word == known)).map(|&word| (named, word))
    };
    // `wing_body` is what a whole aircraft without a tail is called, and no fuselage.
    let rows = WORDS.iter().filter(|(named, _)| *named != Named::Fuselage || !words.iter().any(|word| word == "wing"));
    rows.filter_map(known).next()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_several_programs_are_understood() {
        for (name, expected) in [
            ("wing", Some(Named::Wing)),
            ("solid_wall_wing_upper", Some(Named::Wing)),
            ("MainWing", Some(Named::Wing)),
            ("wing_tip", Some(Named::Wingtip)),
            ("WINGTIP2", Some(Named::Wingtip)),
            ("TrailingEdge", Some(Named::TrailingEdge)),
            ("wing-te", Some(Named::TrailingEdge)),
            ("tail_te", Some(Named::TrailingEdge)),
            ("winglet_tip", Some(Named::Carried)),
            ("left.fuselage", Some(Named::Fuselage)),
            ("y_symmetry", Some(Named::Plane)),
            ("riemann_inflow_aft_upper", Some(Named::Far)),
            // No word of these says anything: `te` and `far` are parts of words.
            ("interface", None),
            ("farm", None),
            ("7", None),
            ("", None),
            ("fwd-up", None),
        ] {
            assert_eq!(named(name).map(|(named, _)| named), expected, "{name}");
        }
    }
}
