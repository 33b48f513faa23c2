//! The lines of an OBJ or MTL file.

use std::borrow::Cow;

/// Yields `(number of the first line, line)` without line ends; lines that end in a backslash are joined.
pub(super) fn logical_lines(bytes: &[u8]) -> impl Iterator<Item = (usize, Cow<'_, [u8]>)> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut lines = bytes.split(|&b| b == b'\n').enumerate();
    std::iter::from_fn(move || {
        let (index, first) = lines.next()?;
        let mut line = Cow::Borrowed(first.trim_ascii_end());
        while line.last() == Some(&b'\\') {
            let joined = line.to_mut();
            joined.pop();
            joined.push(b' ');
            let Some((_, next)) = lines.next() else { break };
            joined.extend_from_slice(next.trim_ascii_end());
        }
        Some((index + 1, line))
    })
}

/// The first word of a line and the rest of it.
pub(super) fn split_keyword(line: &[u8]) -> (&[u8], &[u8]) {
    let line = line.trim_ascii_start();
    let end = line.iter().position(u8::is_ascii_whitespace).unwrap_or(line.len());
    (&line[..end], line[end..].trim_ascii())
}

/// The words of a line up to a comment.
pub(super) fn words(rest: &[u8]) -> impl Iterator<Item = &[u8]> {
    let text = rest.iter().position(|&b| b == b'#').map_or(rest, |end| &rest[..end]);
    text.split(u8::is_ascii_whitespace).filter(|w| !w.is_empty())
}

/// A word as a number.
pub(super) fn number<T: std::str::FromStr>(word: &[u8]) -> Option<T> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// A word for a message.
pub(super) fn shown(word: &[u8]) -> String {
    String::from_utf8_lossy(&word[..word.len().min(40)]).into_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joins_and_counts_lines() {
        let text = b"\xef\xbb\xbfv 1\\\r\n2 3 # c\r\n\nf 1\t2 3\\";
        let lines: Vec<_> = logical_lines(text).collect();
        assert_eq!(lines[0], (1, Cow::Borrowed(&b"v 1 2 3 # c"[..])));
        assert_eq!(lines[1].0, 3);
        assert_eq!(lines[2], (4, Cow::Borrowed(&b"f 1\t2 3 "[..])));
        let (keyword, rest) = split_keyword(&lines[0].1);
        assert_eq!((keyword, words(rest).collect::<Vec<_>>()), (&b"v"[..], vec![&b"1"[..], b"2", b"3"]));
    }
}
