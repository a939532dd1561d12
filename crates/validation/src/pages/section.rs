//! Sections of a page that are rebuilt on their own.

use anyhow::{Context, Result, ensure};

use super::figure::Rendered;

/// A section of a page, with the heading that it begins with.
pub(super) struct Section {
    /// Name on the command line.
    pub(super) name: &'static str,
    /// Writes it, from its heading on.
    pub(super) write: fn(&mut Rendered) -> Result<()>,
}

/// Mark of a heading.
const HEADING: &str = "\n## ";

/// A page with one of its sections in place of that with the same heading.
pub(super) fn with_section(page: &str, section: &str) -> Result<String> {
    let section = section.strip_prefix('\n').unwrap_or(section);
    let heading = section.lines().next().unwrap_or_default();
    ensure!(heading.starts_with(&HEADING[1..]), "a section begins with its heading");
    let start = page
        .find(&format!("\n{heading}\n"))
        .with_context(|| format!("the page has no `{heading}`: rebuild the whole page"))?
        + 1;
    let rest = &page[start + heading.len()..];
    let end = rest.find(HEADING).map_or(page.len(), |at| start + heading.len() + at + 1);
    let gap = if end < page.len() && !section.ends_with("\n\n") { "\n" } else { "" };
    Ok(format!("{}{section}{gap}{}", &page[..start], &page[end..]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_section_takes_the_place_of_its_own() {
        let page = "# Page\n\n## One\n\na\n\n## Two\n\nb\n";
        let found = with_section(page, "\n## One\n\nc\n").unwrap();
        assert_eq!(found, "# Page\n\n## One\n\nc\n\n## Two\n\nb\n");
        let found = with_section(&found, "\n## Two\n\nd\n").unwrap();
        assert_eq!(found, "# Page\n\n## One\n\nc\n\n## Two\n\nd\n");
        assert!(with_section(page, "\n## Three\n").is_err());
        assert!(with_section(page, "no heading").is_err());
    }
}
