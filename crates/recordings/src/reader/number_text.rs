//! Numbers as programs of all countries write them.

/// Words and signs that stand where a value lacks, in lower case.
const LACKING: [&str; 12] =
    ["nan", "na", "n/a", "#n/a", "null", "none", "nil", "-", "--", "-nan", "1.#qnan", "<na>"];
/// Digits of a group of thousands.
const GROUP_DIGITS: usize = 3;

/// The number in a text, with a comma for the point if that is how it is written; `nan` and `inf`
/// are numbers here.
///
/// Thousands may stand apart by what is not the mark of decimals where that mark follows, and by
/// blanks or `'` anywhere. An exponent may have a `D`, a sign may be the one of typography.
pub(super) fn parse(text: &str, has_decimal_comma: bool) -> Option<f64> {
    if !has_decimal_comma || !text.contains(',') {
        // 1.234 between numbers like 1,5 may be one of thousands
        let is_open = has_decimal_comma && are_groups_alone(text);
        if let Ok(value) = text.parse()
            && !is_open
        {
            return Some(value);
        }
    } else if !text.contains('.')
        && let Ok(value) = text.replacen(',', ".", 1).parse()
    {
        return Some(value);
    }
    respelt(text, has_decimal_comma)?.parse().ok()
}

/// The number as a program writes it.
fn respelt(text: &str, has_decimal_comma: bool) -> Option<String> {
    let mark = if has_decimal_comma { ',' } else { '.' };
    let text = text.replace('\u{2212}', "-");
    let text = text.replace(['D', 'd'], "e");
    let (mantissa, exponent) = match text.find(['e', 'E']) {
        Some(at) => text.split_at(at),
        None => (text.as_str(), ""),
    };
    let (whole, decimals) = match mantissa.split_once(mark) {
        Some((whole, decimals)) => (whole, Some(decimals)),
        None => (mantissa, None),
    };
    let digits = |part: &str| part.bytes().all(|byte| byte.is_ascii_digit());
    if !decimals.is_none_or(digits) {
        return None;
    }
    let whole = without_groups(whole, decimals.is_some(), has_decimal_comma)?;
    Some(format!("{whole}.{}{exponent}", decimals.unwrap_or("0")))
}

/// A whole number whose groups of thousands are joined.
fn without_groups(whole: &str, has_decimals: bool, has_decimal_comma: bool) -> Option<String> {
    let (sign, digits) = match whole.strip_prefix(['-', '+']) {
        Some(rest) => (&whole[..1], rest),
        None => ("", whole),
    };
    let other = if has_decimal_comma { '.' } else { ',' };
    let is_apart = |letter: char| {
        matches!(letter, ' ' | '\'' | '\u{a0}' | '\u{2019}' | '\u{202f}') || letter == other
    };
    // a mark alone could be that of decimals
    if digits.contains(other) && !has_decimals {
        return None;
    }
    let mut parts = digits.split(is_apart);
    let first = parts.next()?;
    let is_number = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    let rest: Vec<&str> = parts.collect();
    let are_groups = rest.iter().all(|part| part.len() == GROUP_DIGITS && is_number(part));
    let is_first = is_number(first) && (rest.is_empty() || first.len() <= GROUP_DIGITS);
    (is_first && are_groups).then(|| format!("{sign}{first}{}", rest.concat()))
}

/// Tells whether a number with points may be one of thousands.
fn are_groups_alone(text: &str) -> bool {
    text.contains('.') && without_groups(text, true, true).is_some()
}

/// Tells whether a cell says that there is no value.
pub(crate) fn is_lacking(cell: &str) -> bool {
    LACKING.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_as_they_are_written() {
        for (text, value) in [
            ("1.5", Some(1.5)),
            ("-1.5e-3", Some(-1.5e-3)),
            ("1.5D-03", Some(1.5e-3)),
            ("\u{2212}2", Some(-2.0)),
            ("1,234.5", Some(1234.5)),
            ("1'234'567.25", Some(1_234_567.25)),
            ("1\u{202f}234", Some(1234.0)),
            ("1,234", None),
            ("1,23.5", None),
            ("12,34", None),
            ("1.2.3", None),
            ("x", None),
            ("", None),
        ] {
            assert_eq!(parse(text, false), value, "{text}");
        }
    }

    #[test]
    fn decimals_may_stand_after_a_comma() {
        for (text, value) in [
            ("1,5", Some(1.5)),
            ("1.234,5", Some(1234.5)),
            ("1\u{a0}234,5E-03", Some(1.2345)),
            ("1.5", Some(1.5)),
            ("1,5.2", None),
            ("1.234", None),
            ("1,2,3", None),
        ] {
            assert_eq!(parse(text, true), value, "{text}");
        }
    }

    #[test]
    fn what_lacks_is_known_by_its_word() {
        assert!(["NaN", "NA", "n/a", "NULL", "-"].into_iter().all(is_lacking));
        assert!(!["", "0", "x", "inf"].into_iter().any(is_lacking));
    }
}
