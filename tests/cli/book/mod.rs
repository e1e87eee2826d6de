//! The README and the book: their commands run, their cases are cases, their links lead somewhere.

mod cases;
mod commands;
mod links;

use std::fs;
use std::path::{Path, PathBuf};

use tempfile::TempDir;

/// A Markdown file.
struct Page {
    /// Relative to the repository.
    path: PathBuf,
    text: String,
}

/// A fenced block of code.
struct Block<'p> {
    language: &'p str,
    /// Of the fence, from 1.
    line: usize,
    lines: Vec<&'p str>,
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn page(path: &str) -> Page {
    let text = fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"));
    Page { path: path.into(), text }
}

/// The README and all pages of the book.
fn pages() -> Vec<Page> {
    let entries = fs::read_dir(root().join("docs/src")).unwrap().map(|entry| entry.unwrap().file_name());
    let mut names: Vec<_> =
        entries.map(|name| name.into_string().unwrap()).filter(|name| name.ends_with(".md")).collect();
    names.sort();
    assert!(names.len() > 10, "{names:?}");
    let book = names.iter().map(|name| page(&format!("docs/src/{name}")));
    std::iter::once(page("README.md")).chain(book).collect()
}

impl Page {
    fn name(&self) -> std::path::Display<'_> {
        self.path.display()
    }

    /// The blocks of code in a language; of every language if it is empty.
    fn blocks(&self, language: &str) -> Vec<Block<'_>> {
        let mut blocks = Vec::new();
        let mut open: Option<Block> = None;
        for (number, line) in self.text.lines().enumerate() {
            match (line.strip_prefix("```"), &mut open) {
                (Some(language), None) => open = Some(Block { language, line: number + 1, lines: Vec::new() }),
                (Some(_), Some(_)) => blocks.extend(open.take()),
                (None, Some(block)) => block.lines.push(line),
                (None, None) => {}
            }
        }
        assert!(open.is_none(), "{}: a block of code does not end", self.name());
        blocks.retain(|block| language.is_empty() || block.language == language);
        blocks
    }

    /// Everything but blocks of code, with the number of each line.
    fn prose(&self) -> Vec<(usize, &str)> {
        let blocks = self.blocks("");
        let in_block = |number: usize| {
            blocks.iter().any(|block| (block.line..=block.line + block.lines.len() + 1).contains(&number))
        };
        let lines = self.text.lines().enumerate().map(|(index, line)| (index + 1, line));
        lines.filter(|&(number, _)| !in_block(number)).collect()
    }

    /// The pieces of code between words, with the numbers of their lines.
    fn spans<'p>(&'p self) -> Vec<(usize, &'p str)> {
        let prose = self.prose();
        for (number, line) in &prose {
            assert!(line.matches('`').count() % 2 == 0, "{}:{number}: code goes on in the next line", self.name());
        }
        let spans =
            |(number, line): (usize, &'p str)| line.split('`').skip(1).step_by(2).map(move |span| (number, span));
        prose.into_iter().flat_map(spans).collect()
    }
}

/// A folder as the text has it: the example in its place and beside the user, and the user's own
/// designs.
fn workplace() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let example = folder.path().join("examples/wing-body");
    fs::create_dir_all(&example).unwrap();
    for entry in fs::read_dir(root().join("examples/wing-body")).unwrap().map(Result::unwrap) {
        // Not what somebody's run of the example left there.
        let name = entry.file_name().into_string().unwrap();
        if ["case.toml", "new.csv", "old.csv", "seed.csv", "wing-body.msh.gz"].contains(&name.as_str()) {
            fs::copy(entry.path(), example.join(&name)).unwrap();
            fs::copy(entry.path(), folder.path().join(&name)).unwrap();
        }
    }
    // The aircraft of the pages on configurations.
    let parts = root().join("tests/data/aircraft");
    let entries =
        |folder: &Path| -> Vec<PathBuf> { fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect() };
    for path in entries(&parts) {
        let files = if path.is_dir() { entries(&path) } else { vec![path] };
        for file in files {
            let place = folder.path().join("aircraft").join(file.strip_prefix(&parts).unwrap());
            fs::create_dir_all(place.parent().unwrap()).unwrap();
            fs::copy(&file, place).unwrap();
        }
    }
    fs::create_dir(folder.path().join("designs")).unwrap();
    fs::copy(example.join("new.csv"), folder.path().join("designs/a.csv")).unwrap();
    folder
}

/// The README is what everybody reads: it stays short, and its picture is there. So is that of the
/// introduction.
#[test]
fn the_readme_is_short_and_has_a_picture() {
    let readme = page("README.md");
    assert!(readme.text.lines().count() <= 150);
    for (text, picture) in [
        (readme.text, "docs/src/images/report.png"),
        (
            page("docs/src/introduction.md").text.replace("](images", "](docs/src/images"),
            "docs/src/images/wing-body.png",
        ),
    ] {
        let bytes = fs::read(root().join(picture)).unwrap();
        assert!(bytes.starts_with(b"\x89PNG") && bytes.len() < 300_000);
        assert!(text.contains(&format!("]({picture})")));
    }
}
