//! The names of the families in files that otherwise hold only their numbers:
//! `families: 1=wing, 2=far field`.

/// A list of the families and their numbers.
pub(in crate::formats) fn list_names(families: &[String]) -> String {
    let list: Vec<_> = families.iter().enumerate().map(|(index, family)| format!("{}={family}", index + 1)).collect();
    let list = format!("families: {}", list.join(", "));
    list.chars().map(|letter| if letter.is_control() { '\u{fffd}' } else { letter }).collect()
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
}
