//! How a report looks: HTML, with the style and the script that sorts tables inside.

use std::fmt::{self, Write};

use super::content::{Block, Cell, Figure, Page, Section, Table};

/// Sources that a report may load from: the report itself alone.
const POLICY: &str = "default-src 'none'; style-src 'unsafe-inline'; script-src 'unsafe-inline'";

/// Screen and paper; marks are bold and underlined, so that they are seen in grey.
const STYLE: &str = include_str!("report.css");

/// Where the rest is, said on paper alone.
const ON_PAPER: &str = "Printed without the details of the recordings, which the page itself has.";

/// Sorts a table by the column whose heading is pressed.
const SCRIPT: &str = include_str!("report.js");

/// The whole document.
pub(super) fn document(page: &Page) -> String {
    let mut out = String::new();
    push_document(&mut out, page).expect("a String takes all text");
    out
}

fn push_document(out: &mut String, page: &Page) -> fmt::Result {
    let title = escaped(&page.title);
    write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>{title}</title>\n<style>\n{STYLE}</style>\n</head>\n<body>\n<main>\n\
         <h1>{title}</h1>\n",
    )?;
    if !page.subject.is_empty() {
        writeln!(out, "<p class=\"subject\">{}</p>", escaped(&page.subject))?;
    }
    writeln!(out, "<p class=\"answer\">{}</p>", prose(&page.answer))?;
    if page.sections.iter().any(|section| !section.details.is_empty()) {
        writeln!(out, "<p class=\"paper\">{ON_PAPER}</p>")?;
    }
    if page.sections.len() > 2 {
        push_contents(out, &page.sections)?;
    }
    let mut counts = Counts::default();
    for (index, section) in page.sections.iter().enumerate() {
        push_section(out, section, index, &mut counts)?;
    }
    write!(out, "</main>\n<script>\n{SCRIPT}</script>\n</body>\n</html>\n")
}

fn push_section(
    out: &mut String,
    section: &Section,
    index: usize,
    counts: &mut Counts,
) -> fmt::Result {
    let class = if section.blocks.is_empty() { " class=\"screen\"" } else { "" };
    write!(out, "<section id=\"s{index}\"{class}>\n<h2>{}</h2>\n", prose(&section.heading))?;
    for block in &section.blocks {
        push_block(out, block, counts)?;
    }
    if !section.details.is_empty() {
        out.push_str("<div class=\"screen\">\n");
        for block in &section.details {
            push_block(out, block, counts)?;
        }
        out.push_str("</div>\n");
    }
    out.push_str("</section>\n");
    Ok(())
}

/// How many of each have been shown.
#[derive(Default)]
struct Counts {
    tables: usize,
    figures: usize,
}

fn push_contents(out: &mut String, sections: &[Section]) -> fmt::Result {
    out.push_str("<nav aria-label=\"Contents\">\n<ol>\n");
    for (index, section) in sections.iter().enumerate() {
        writeln!(out, "<li><a href=\"#s{index}\">{}</a></li>", prose(&section.heading))?;
    }
    out.push_str("</ol>\n</nav>\n");
    Ok(())
}

fn push_block(out: &mut String, block: &Block, counts: &mut Counts) -> fmt::Result {
    match block {
        Block::Text(text) => writeln!(out, "<p>{}</p>", prose(text)),
        Block::List(items) => {
            out.push_str("<ul>\n");
            for item in items {
                writeln!(out, "<li>{}</li>", prose(item))?;
            }
            out.push_str("</ul>\n");
            Ok(())
        }
        Block::Table(table) => {
            counts.tables += 1;
            push_table(out, table, counts.tables)
        }
        Block::Figure(figure) => {
            counts.figures += 1;
            push_figure(out, figure, counts.figures)
        }
    }
}

fn push_table(out: &mut String, table: &Table, number: usize) -> fmt::Result {
    write!(
        out,
        "<div class=\"wide\">\n<table class=\"sortable\">\n<caption><span>Table {number}. {}</span></caption>\n\
         <thead><tr>",
        prose(&table.caption)
    )?;
    for column in &table.columns {
        let class = if column.numeric { " class=\"number\"" } else { "" };
        write!(
            out,
            "<th scope=\"col\"{class}><button type=\"button\">{}</button></th>",
            escaped(&column.name)
        )?;
    }
    out.push_str("</tr></thead>\n<tbody>\n");
    for row in &table.rows {
        out.push_str("<tr>");
        for (cell, column) in row.iter().zip(&table.columns) {
            push_cell(out, cell, column.numeric)?;
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody>\n</table>\n</div>\n");
    Ok(())
}

/// Longest text of a cell that stands on one line, bytes.
const LONGEST_WORD: usize = 12;

fn push_cell(out: &mut String, cell: &Cell, numeric: bool) -> fmt::Result {
    // a date or an identity is broken nowhere
    let is_word = !numeric && cell.text.len() <= LONGEST_WORD && !cell.text.contains(' ');
    let classes: Vec<&str> = [(numeric, "number"), (is_word, "word"), (cell.marked, "marked")]
        .into_iter()
        .filter_map(|(is_so, class)| is_so.then_some(class))
        .collect();
    let class = if classes.is_empty() {
        String::new()
    } else {
        format!(" class=\"{}\"", classes.join(" "))
    };
    let value = match (cell.value, numeric) {
        (Some(value), _) => format!(" data-value=\"{value}\""),
        // an empty one says that nothing is there to sort by
        (None, true) => " data-value=\"\"".to_owned(),
        (None, false) => String::new(),
    };
    write!(out, "<td{class}{value}>{}</td>", prose(&cell.text))
}

fn push_figure(out: &mut String, figure: &Figure, number: usize) -> fmt::Result {
    write!(
        out,
        "<figure>\n{}<figcaption><b>Figure {number}.</b> {} <span class=\"source\">From: {}</span>\
         </figcaption>\n</figure>\n",
        figure.svg,
        prose(&figure.caption),
        escaped(&figure.source)
    )
}

/// Text in which what stands between backticks is a word of the program.
fn prose(text: &str) -> String {
    let text = escaped(text);
    let parts: Vec<&str> = text.split('`').collect();
    if parts.len().is_multiple_of(2) {
        // one that is not closed is none
        return text;
    }
    let code = |(place, part): (usize, &&str)| {
        if place % 2 == 1 { format!("<code>{part}</code>") } else { (*part).to_owned() }
    };
    parts.iter().enumerate().map(code).collect()
}

/// Text as HTML has it.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    text.replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::content::Column;

    #[test]
    fn text_cannot_become_markup() {
        let nasty = "<script>alert('\"1\" & 2')</script>".to_owned();
        let table = Table {
            caption: nasty.clone(),
            columns: vec![Column::text(&nasty), Column::number("n")],
            rows: vec![vec![Cell::text(nasty.clone()), Cell::number(None, |v| v.to_string())]],
        };
        let figure = Figure {
            name: "f".to_owned(),
            svg: "<svg></svg>\n".to_owned(),
            caption: nasty.clone(),
            source: nasty.clone(),
        };
        let blocks = vec![
            Block::Text(nasty.clone()),
            Block::List(vec![nasty.clone()]),
            Block::Table(table),
            Block::Figure(figure),
        ];
        let section = Section::new(nasty.clone(), blocks);
        let page = Page {
            title: nasty.clone(),
            subject: nasty.clone(),
            answer: nasty,
            sections: vec![section],
        };
        let html = document(&page);
        assert_eq!(html.matches("<script>").count(), 1);
        assert_eq!(html.matches("&lt;script&gt;alert").count(), 12);
    }

    #[test]
    fn words_of_the_program_look_it() {
        assert_eq!(prose("run `a < b` now"), "run <code>a &lt; b</code> now");
        assert_eq!(prose("one ` alone, `x` or not"), "one ` alone, `x` or not");
        assert_eq!(prose("plain"), "plain");
    }

    #[test]
    fn nothing_is_named_that_would_be_loaded() {
        let html = document(&Page::default());
        for loads in ["src=", "http://", "https://", "url(", "@import", "<link"] {
            assert!(!html.contains(loads), "{loads}");
        }
    }
}
