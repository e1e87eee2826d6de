//! Every link leads to a file that is there, and to a heading in it.

use std::fs;
use std::path::{Component, Path, PathBuf};

use super::{Page, page, pages, root};

/// The places that a page links to, with the numbers of their lines; none in code.
fn links(page: &Page) -> Vec<(usize, String)> {
    let mut links = Vec::new();
    for (number, line) in page.prose() {
        let words: String = line.split('`').step_by(2).collect::<Vec<_>>().join("code");
        for piece in words.split("](").skip(1) {
            links.push((number, piece.split(')').next().unwrap().to_owned()));
        }
    }
    links
}

/// The anchors of a page's headings, as GitHub and mdBook make them.
fn anchors(page: &Page) -> Vec<String> {
    let heading = |line: &str| line.starts_with('#').then(|| line.trim_start_matches('#').trim().to_owned());
    let anchor = |heading: String| -> String {
        let kept = heading.to_lowercase().replace(' ', "-");
        kept.chars().filter(|character| character.is_alphanumeric() || "-_".contains(*character)).collect()
    };
    page.prose().into_iter().filter_map(|(_, line)| heading(line)).map(anchor).collect()
}

/// A path without `.` and `..`.
fn tidy(path: &Path) -> PathBuf {
    let mut tidy = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir => assert!(tidy.pop(), "{} leads out of the repository", path.display()),
            Component::CurDir => {}
            component => tidy.push(component),
        }
    }
    tidy
}

#[test]
fn links_lead_somewhere() {
    let others = [
        "ARCHITECTURE.md",
        "CHANGELOG.md",
        "benches/README.md",
        "kernels/README.md",
        "examples/arrays/README.md",
        "examples/loops/README.md",
        "examples/openfoam/README.md",
        "examples/wing-body/README.md",
    ];
    let mut n_links = 0;
    for page in pages().into_iter().chain(others.map(page)) {
        for (number, link) in links(&page) {
            let place = format!("{}:{number}: {link}", page.name());
            if link.starts_with("https://") {
                continue;
            }
            n_links += 1;
            let (file, anchor) =
                link.split_once('#').map_or((link.as_str(), None), |(file, anchor)| (file, Some(anchor)));
            let target = if file.is_empty() {
                page.path.clone()
            } else {
                tidy(&page.path.parent().unwrap_or(Path::new("")).join(file))
            };
            assert!(root().join(&target).exists(), "{place}: no such file");
            if page.path.starts_with("docs/src") {
                assert!(target.starts_with("docs/src"), "{place}: the built book does not hold it");
            }
            if let Some(anchor) = anchor {
                let text = fs::read_to_string(root().join(&target)).unwrap();
                let headings = anchors(&Page { path: target, text });
                assert!(headings.iter().any(|heading| heading == anchor), "{place}: no such heading: {headings:?}");
            }
        }
    }
    assert!(n_links > 50, "{n_links}");
}

/// A page that the summary does not list is in no book.
#[test]
fn every_page_is_in_the_summary() {
    let summary = page("docs/src/SUMMARY.md");
    let listed: Vec<String> = links(&summary).into_iter().map(|(_, link)| link).collect();
    for page in pages() {
        let name = page.path.file_name().unwrap().to_str().unwrap();
        if !["README.md", "SUMMARY.md"].contains(&name) {
            assert!(listed.iter().any(|link| link == name), "{name} is not in docs/src/SUMMARY.md");
        }
    }
}

#[test]
fn anchors_are_made_of_headings() {
    let text = "# A wing: `a`, b\n```sh\n# no heading\n```\n## Exit codes\n";
    let page = Page { path: "a.md".into(), text: text.to_owned() };
    assert_eq!(anchors(&page), ["a-wing-a-b", "exit-codes"]);
    let text = "[a](b.md#c) `[d](e)` ![f](g.png), [h](https://i)";
    let page = Page { path: "a.md".into(), text: text.to_owned() };
    let links: Vec<String> = links(&page).into_iter().map(|(_, link)| link).collect();
    assert_eq!(links, ["b.md#c", "g.png", "https://i"]);
}
