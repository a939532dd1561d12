//! The first difference of two files.

/// Characters of a line that are shown on each side of a difference.
const SHOWN: usize = 80;

/// The place of the first byte that differs; `None` where none does.
pub(super) fn first_difference(a: &[u8], b: &[u8]) -> Option<usize> {
    let common = a.iter().zip(b).take_while(|(a, b)| a == b).count();
    (common < a.len().max(b.len())).then_some(common)
}

/// Place, line and both lines of a difference; of bytes that are no text the place and the lengths.
pub(super) fn shown(a: &[u8], b: &[u8], place: usize) -> String {
    let (Ok(a_text), Ok(b_text)) = (std::str::from_utf8(a), std::str::from_utf8(b)) else {
        return format!("byte {place} of {} and {}", a.len(), b.len());
    };
    let line = a[..place].split(|&byte| byte == b'\n').count();
    let begin = a[..place].iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    let column = place - begin;
    let of = |text: &str| {
        let line = text.lines().nth(line - 1).unwrap_or("nothing more");
        let middle = line.char_indices().take_while(|(at, _)| *at < column).count();
        let from = middle.saturating_sub(SHOWN);
        line.chars().skip(from).take(2 * SHOWN).collect::<String>()
    };
    format!("byte {place}, line {line}: `{}` and `{}`", of(a_text), of(b_text))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_difference_is_found_with_its_line() {
        assert_eq!(first_difference(b"ab\ncd", b"ab\ncd"), None);
        let (a, b) = (b"ab\ncd\ne".as_slice(), b"ab\ncx\ne".as_slice());
        assert_eq!(first_difference(a, b), Some(4));
        assert_eq!(shown(a, b, 4), "byte 4, line 2: `cd` and `cx`");
        assert_eq!(first_difference(b"ab", b"abc"), Some(2));
        assert_eq!(shown(&[0xff, 0], &[0xff, 1], 1), "byte 1 of 2 and 2");
    }
}
