//! The length of sentences on the pages that a newcomer reads.
//!
//! How it counts:
//!
//! - Prose is what is left of a page without fenced code, tables (lines that begin with `|`),
//!   headings, equations between `$$` and comments of HTML.
//! - A blank line, a list marker and anything left out end a paragraph; the lines of a paragraph
//!   are joined. A paragraph's end ends its last sentence.
//! - Within a paragraph a sentence ends at `.`, `!` or `?`, with closing quotes and brackets after
//!   it, where the next word begins with a capital letter, a digit, a quote, a bracket or code.
//!   Abbreviations and initials end none.
//! - A word is what stands between blanks and has a letter or a digit. A piece of inline code, an
//!   inline formula and a link's address are one word, one word and none.
//! - The percentile is that of the nearest rank: the least length that at least this share of the
//!   sentences does not exceed. It is taken page by page.

use std::{fs, path::Path};

/// Most words that a sentence has, but for one in twenty of a page.
const MOST_WORDS: usize = 35;

/// Share of a page's sentences that keep to it, per cent.
const SHARE_PERCENT: usize = 95;

/// Pages whose sentences are counted, each by the beginning of its path.
///
/// Decisions from 0100 on alone are counted: earlier pages stay as they were
/// written.
const PAGES: [&str; 7] = [
    "docs/ARCHITECTURE.md",
    "docs/decisions/01",
    "docs/decisions/README.md",
    "docs/glossary.md",
    "docs/guide/",
    "docs/stability.md",
    "docs/validation/units.md",
];

/// Words after which a full stop ends no sentence.
const ABBREVIATIONS: [&str; 11] =
    ["al.", "approx.", "cf.", "e.g.", "eq.", "eqs.", "fig.", "figs.", "i.e.", "vs.", "etc."];

/// Counted pages with too many long sentences, each with its percentile and its longest sentence.
pub(crate) fn check(root: &Path, files: &[String]) -> Vec<String> {
    files.iter().filter(|file| is_counted(file)).filter_map(|file| over(root, file)).collect()
}

fn is_counted(file: &str) -> bool {
    let markdown = Path::new(file).extension().is_some_and(|extension| extension == "md");
    markdown && PAGES.iter().any(|page| file.starts_with(page))
}

fn over(root: &Path, file: &str) -> Option<String> {
    let text = fs::read_to_string(root.join(file)).ok()?;
    let found = percentile(sentences(&text), SHARE_PERCENT)?;
    (found > MOST_WORDS).then(|| {
        let longest = split(&text).into_iter().max_by_key(|sentence| words(sentence));
        format!(
            "{file}: {SHARE_PERCENT} % of the sentences have up to {found} words, expected \
             {MOST_WORDS} or fewer; the longest is `{}`",
            longest.unwrap_or_default()
        )
    })
}

/// Lengths in words of the sentences of a page in Markdown, in their order.
pub(crate) fn sentences(text: &str) -> Vec<usize> {
    split(text).iter().map(|sentence| words(sentence)).filter(|&count| count > 0).collect()
}

/// The least of the lengths that `percent` of them do not exceed; `None` of nothing.
pub(crate) fn percentile(mut lengths: Vec<usize>, percent: usize) -> Option<usize> {
    lengths.sort_unstable();
    let rank = (lengths.len() * percent).div_ceil(100);
    lengths.get(rank.checked_sub(1)?).copied()
}

fn words(sentence: &str) -> usize {
    sentence.split_whitespace().filter(|word| word.contains(char::is_alphanumeric)).count()
}

/// The sentences of a page, code and formulas in them as one word each.
fn split(text: &str) -> Vec<String> {
    paragraphs(text).iter().flat_map(|paragraph| sentences_of(paragraph)).collect()
}

/// Paragraphs of prose, each on one line.
fn paragraphs(text: &str) -> Vec<String> {
    let mut found = vec![String::new()];
    let mut left_out = LeftOut::Nothing;
    for line in text.lines().map(str::trim) {
        let was = left_out;
        left_out = was.after(line);
        let outside = was == LeftOut::Nothing && left_out == LeftOut::Nothing;
        if !outside || is_no_prose(line) {
            found.push(String::new());
            continue;
        }
        let item = without_marker(line);
        if item.len() < line.len() {
            found.push(String::new());
        }
        let paragraph = found.last_mut().expect("it begins with one");
        paragraph.push(' ');
        paragraph.push_str(item);
    }
    found.iter().map(|paragraph| as_words(paragraph)).collect()
}

/// A block over several lines that is no prose.
#[derive(Clone, Copy, PartialEq)]
enum LeftOut {
    Nothing,
    Code,
    Equation,
    Comment,
}

impl LeftOut {
    /// Part that is left out after a line.
    fn after(self, line: &str) -> Self {
        match self {
            Self::Code if line.starts_with("```") => Self::Nothing,
            Self::Equation if line.ends_with("$$") => Self::Nothing,
            Self::Comment if line.contains("-->") => Self::Nothing,
            Self::Nothing if line.starts_with("```") => Self::Code,
            Self::Nothing if line.starts_with("$$") && line.matches("$$").count() == 1 => {
                Self::Equation
            }
            Self::Nothing if line.starts_with("<!--") && !line.contains("-->") => Self::Comment,
            _ => self,
        }
    }
}

fn is_no_prose(line: &str) -> bool {
    line.is_empty() || ["|", "#", "$$", "<!--", "```"].iter().any(|mark| line.starts_with(mark))
}

/// A line without the marker of a list's item.
fn without_marker(line: &str) -> &str {
    if let Some(item) = line.strip_prefix("- ").or_else(|| line.strip_prefix("* ")) {
        return item;
    }
    let number = line.trim_start_matches(|c: char| c.is_ascii_digit());
    match number.strip_prefix(". ") {
        Some(item) if number.len() < line.len() => item,
        _ => line,
    }
}

/// A paragraph with each piece of code and each formula as one word, links as their text.
fn as_words(paragraph: &str) -> String {
    let mut result = String::new();
    let mut rest = paragraph.trim();
    while let Some(at) = rest.find(['`', '$', ']']) {
        result.push_str(&rest[..at]);
        rest = &rest[at..];
        let mark = &rest[..rest.len() - rest.trim_start_matches(&rest[..1]).len()];
        let inside = &rest[mark.len()..];
        if let Some(address) = rest.strip_prefix("](") {
            rest = address.split_once(')').map_or("", |(_, after)| after);
        } else if mark.starts_with(']') {
            rest = inside;
        } else if let Some((_, after)) = inside.split_once(mark) {
            result.push_str("`x`");
            rest = after;
        } else {
            rest = inside;
        }
    }
    result.push_str(rest);
    result
}

fn sentences_of(paragraph: &str) -> Vec<String> {
    let words: Vec<&str> = paragraph.split_whitespace().collect();
    let mut found = Vec::new();
    let mut begin = 0;
    for place in 0..words.len() {
        let next = words.get(place + 1);
        if next.is_none_or(|next| ends(words[place]) && begins(next)) {
            found.push(words[begin..=place].join(" "));
            begin = place + 1;
        }
    }
    found
}

/// True where a sentence can end with a word.
fn ends(word: &str) -> bool {
    let bare = word.trim_end_matches(['"', '\'', ')', '*', '”', ']']);
    let opened = bare.trim_start_matches(['(', '"', '*', '[']);
    let initial = opened.len() == 2 && opened.starts_with(|c: char| c.is_ascii_uppercase());
    bare.ends_with(['.', '!', '?'])
        && !initial
        && !ABBREVIATIONS.contains(&opened.to_lowercase().as_str())
}

/// True where a sentence can begin with a word.
fn begins(word: &str) -> bool {
    let bare = word.trim_start_matches('*');
    bare.starts_with(|c: char| c.is_uppercase() || c.is_ascii_digit() || "`\"'([“".contains(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_prose_is_counted() {
        let page = "# A heading that is not counted\n\nOne two three. Four five.\n\n\
                    | a | table of words |\n| --- | --- |\n```sh\nnot counted either.\n```\n\
                    $$ x = y $$\n$$ a\n= b c d $$\n<!-- nor\nthis -->\nSix\nseven.\n";
        assert_eq!(sentences(page), [3, 2, 2]);
    }

    #[test]
    fn items_of_a_list_are_sentences() {
        let page = "It has parts:\n- one part\n- another part, which\n  goes on\n1. a first\n";
        assert_eq!(sentences(page), [3, 2, 5, 2]);
    }

    #[test]
    fn code_formulas_and_links_are_words() {
        let page =
            "Give `--noise-a 0.02. And more` with $a + b = c$ by [this page](its address.md).";
        assert_eq!(sentences(page), [7]);
        assert_eq!(sentences("Say ``a `quoted` word`` — twice."), [3]);
    }

    #[test]
    fn abbreviations_decimals_and_initials_end_no_sentence() {
        assert_eq!(sentences("By M. Borresen et al. 2015, e.g. in eq. 4 at 0.5 rad."), [13]);
        assert_eq!(
            sentences("It reads fdi.toml in a folder. `fdi` ranks it (*so.*) Then it ends."),
            [6, 4, 3]
        );
    }

    #[test]
    fn percentile_is_that_of_the_nearest_rank() {
        assert_eq!(percentile((1..=100).collect(), 95), Some(95));
        assert_eq!(percentile((1..=20).rev().collect(), 95), Some(19));
        assert_eq!(percentile(vec![7], 95), Some(7));
        assert_eq!(percentile(Vec::new(), 95), None);
    }

    #[test]
    fn decisions_are_counted_from_0100_on() {
        let counted = ["0100-a.md", "0122-b.md", "0199-c.md", "README.md"];
        assert!(counted.iter().all(|page| is_counted(&format!("docs/decisions/{page}"))));
        let earlier = ["0001-a.md", "0020-b.md", "0093-c.md"];
        assert!(!earlier.iter().any(|page| is_counted(&format!("docs/decisions/{page}"))));
        assert!(!is_counted("docs/decisions/0100-a.svg"));
    }

    #[test]
    fn single_pages_are_counted_by_name() {
        assert!(is_counted("docs/ARCHITECTURE.md") && is_counted("docs/validation/units.md"));
        assert!(!is_counted("docs/validation/other.md"));
    }

    #[test]
    fn long_sentences_of_counted_pages_are_found() {
        let root = tempfile::tempdir().unwrap();
        let long = format!("{}end.", "word ".repeat(MOST_WORDS));
        fs::create_dir_all(root.path().join("docs/guide")).unwrap();
        fs::write(root.path().join("docs/guide/long.md"), &long).unwrap();
        fs::write(root.path().join("docs/guide/short.md"), "Three words here.").unwrap();
        fs::write(root.path().join("docs/free.md"), &long).unwrap();
        let files = ["docs/guide/long.md", "docs/guide/short.md", "docs/free.md"];
        let problems = check(root.path(), &files.map(str::to_owned));
        assert_eq!(problems.len(), 1, "{problems:?}");
        assert!(problems[0].starts_with("docs/guide/long.md: 95 % of the sentences have up to 36"));
    }
}
