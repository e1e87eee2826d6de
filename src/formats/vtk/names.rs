//! The names of the families in files that otherwise hold only their numbers:
//! `families: 1=wing, 2=far field`.

use crate::formats::new_file::different_names;

/// A list of the families and their numbers, with the names of [`listed_names`].
pub(in crate::formats) fn list_names(families: &[String]) -> String {
    list(&listed_names(families))
}

/// The names of the families as a list holds them. All names are different.
pub(in crate::formats) fn listed_names(families: &[String]) -> Vec<String> {
    // A list ends before the white space at its end. `&#45;` stands for a hyphen.
    let names: Vec<String> = families.iter().map(|name| name.trim_end().replace("&#45;", "&_45;")).collect();
    let names = different_names(&names, |letter| !letter.is_control());
    let found: Vec<String> = parse_names(&list(&names)).into_iter().map(|(_, name)| name).collect();
    // A name that holds the beginning of the next name must not end there.
    if found == names { names } else { different_names(&names, |letter| letter != ',') }
}

fn list(names: &[String]) -> String {
    let list: Vec<_> = names.iter().enumerate().map(|(index, name)| format!("{}={name}", index + 1)).collect();
    format!("families: {}", list.join(", "))
}

/// The numbers and names in a list. Empty if the text is no such list.
pub(in crate::formats) fn parse_names(text: &str) -> Vec<(i32, String)> {
    let Some((_, mut rest)) = text.split_once("families: ") else { return Vec::new() };
    rest = rest.trim_end();
    let mut names = Vec::new();
    for number in 1.. {
        let Some(after) = rest.strip_prefix(&format!("{number}=")) else { break };
        // A name may hold a comma, but not the beginning of the next name.
        let next = format!(", {}=", number + 1);
        let (name, following) =
            after.split_once(&next).map_or((after, ""), |(name, _)| (name, &after[name.len() + 2..]));
        names.push((number, name.replace("&#45;", "-")));
        rest = following;
    }
    names
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_come_back() {
        let names = ["wing", "far, field", "", "a=b", "2=c"].map(str::to_owned);
        let listed = list_names(&names);
        assert_eq!(listed, "families: 1=wing, 2=far, field, 3=, 4=a=b, 5=2=c");
        let back: Vec<String> = parse_names(&format!(" {listed} ")).into_iter().map(|(_, name)| name).collect();
        assert_eq!(back, names);
        assert!(parse_names("This file was created by meshio").is_empty());
    }

    /// Names that a list cannot hold are changed so that they stay apart.
    #[test]
    fn other_names_are_changed_and_come_back() {
        for (names, listed) in [
            (["a\u{1}", "a\u{2}", "a\n"], ["a_", "a__2", "a"]),
            (["a, 2=b", "c", "d"], ["a_ 2=b", "c", "d"]),
            (["a&#45;b", "a-b", "-->"], ["a&_45;b", "a-b", "-->"]),
            (["a", "b", "b \u{2003}"], ["a", "b", "b_2"]),
        ] {
            let names = names.map(str::to_owned);
            assert_eq!(listed_names(&names), listed);
            let back: Vec<String> = parse_names(&list_names(&names)).into_iter().map(|(_, name)| name).collect();
            assert_eq!(back, listed);
        }
    }
}
