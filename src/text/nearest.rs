//! "Did you mean": the known name nearest to a mistyped one.

/// `; did you mean `tolerance`?` when a known name is near enough to be a slip of the hand.
pub(crate) fn did_you_mean<S: AsRef<str>>(name: &str, known: &[S]) -> Option<String> {
    nearest(name, known).map(|nearest| format!("; did you mean `{nearest}`?"))
}

/// The nearest known name, if it is near.
pub(crate) fn nearest<'k, S: AsRef<str>>(name: &str, known: &'k [S]) -> Option<&'k str> {
    // One slip, and another for every four letters: "tip" does not suggest "wing", "trailingedge"
    // does suggest "trailing_edge".
    let allowed = 1 + name.chars().count() / 4;
    let length = name.chars().count();
    known
        .iter()
        .map(AsRef::as_ref)
        // Each letter more or less is a slip.
        .filter(|candidate| candidate.chars().count().abs_diff(length) <= allowed)
        .map(|candidate| (strsim::damerau_levenshtein(&name.to_lowercase(), &candidate.to_lowercase()), candidate))
        .min()
        .filter(|&(distance, _)| distance <= allowed)
        .map(|(_, candidate)| candidate)
}

/// Most names of a list in a message.
pub(crate) const SHOWN: usize = 20;

/// `` `a`, `b`, `c` ``. Of a long list the first names, and the number of the others.
pub(crate) fn quoted<S: AsRef<str>>(names: &[S]) -> String {
    first_of(names.len(), names.iter().map(|name| format!("`{}`", name.as_ref())))
}

/// The first words of a list of `count` words, and the number of the others.
pub(crate) fn first_of(count: usize, words: impl Iterator<Item = String>) -> String {
    let mut words: Vec<String> = words.take(SHOWN).collect();
    if count > SHOWN {
        words.push(format!("and {} more", count - SHOWN));
    }
    words.join(", ")
}

/// `` `a`, `b` or `c` ``.
pub(crate) fn quoted_list<S: AsRef<str>>(names: &[S]) -> String {
    let quoted: Vec<_> = names.iter().map(|name| format!("`{}`", name.as_ref())).collect();
    match quoted.split_last() {
        None => "nothing".into(),
        Some((last, [])) => last.clone(),
        Some((last, rest)) => format!("{} or {last}", rest.join(", ")),
    }
}
