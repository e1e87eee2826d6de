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
    known
        .iter()
        .map(|candidate| {
            let candidate = candidate.as_ref();
            (strsim::damerau_levenshtein(&name.to_lowercase(), &candidate.to_lowercase()), candidate)
        })
        .min()
        .filter(|&(distance, _)| distance <= allowed)
        .map(|(_, candidate)| candidate)
}

/// `` `a`, `b`, `c` ``.
pub(crate) fn quoted<S: AsRef<str>>(names: &[S]) -> String {
    names.iter().map(|name| format!("`{}`", name.as_ref())).collect::<Vec<_>>().join(", ")
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
