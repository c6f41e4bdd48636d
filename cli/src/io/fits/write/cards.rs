//! Header cards in the fixed format of FITS (standard 4.0, §4.2).

use super::super::card::CARD;
use super::super::header::BLOCK;

/// A header being written.
pub(super) struct Cards {
    bytes: Vec<u8>,
}

impl Cards {
    /// The header of an empty primary HDU.
    pub(super) fn primary() -> Vec<u8> {
        let mut cards = Self { bytes: Vec::new() };
        cards.logical("SIMPLE", true, "conforms to the FITS standard");
        cards.integer("BITPIX", 8, "");
        cards.integer("NAXIS", 0, "no data here");
        cards.logical("EXTEND", true, "there are extensions");
        cards.finish()
    }

    /// The beginning of a binary table of `rows` rows of `row_len` bytes.
    pub(super) fn table(row_len: usize, rows: usize, fields: usize) -> Self {
        let mut cards = Self { bytes: Vec::new() };
        cards.text("XTENSION", "BINTABLE", "binary table");
        cards.integer("BITPIX", 8, "");
        cards.integer("NAXIS", 2, "");
        cards.integer("NAXIS1", row_len as u64, "bytes of a row");
        cards.integer("NAXIS2", rows as u64, "rows");
        cards.integer("PCOUNT", 0, "");
        cards.integer("GCOUNT", 1, "");
        cards.integer("TFIELDS", fields as u64, "columns");
        cards
    }

    /// A string; what is no printable ASCII becomes `?`, what is too long for the card is cut.
    pub(super) fn text(&mut self, key: &str, value: &str, comment: &str) {
        let mut quoted = String::from("'");
        let mut count = 0;
        for c in value.chars() {
            let c = if (' '..='~').contains(&c) { c } else { '?' };
            // Between `= ` and the end of the card there are 70 characters, two of them quotes.
            let width = if c == '\'' { 2 } else { 1 };
            if count + width > CARD - 12 {
                break;
            }
            (0..width).for_each(|_| quoted.push(c));
            count += width;
        }
        // A string has at least eight characters, which matters for XTENSION.
        (count..8).for_each(|_| quoted.push(' '));
        quoted.push('\'');
        self.card(key, &format!("{quoted:<20}"), comment);
    }

    pub(super) fn integer(&mut self, key: &str, value: u64, comment: &str) {
        self.card(key, &format!("{value:>20}"), comment);
    }

    pub(super) fn real(&mut self, key: &str, value: f64, comment: &str) {
        let mut shown = format!("{value:?}").replace('e', "E");
        if !shown.contains('.') {
            shown = shown.replace('E', ".0E");
        }
        self.card(key, &format!("{shown:>20}"), comment);
    }

    pub(super) fn logical(&mut self, key: &str, value: bool, comment: &str) {
        self.card(
            key,
            &format!("{:>20}", if value { "T" } else { "F" }),
            comment,
        );
    }

    fn card(&mut self, key: &str, value: &str, comment: &str) {
        let mut card = format!("{key:<8}= {value}");
        if !comment.is_empty() && card.len() + 3 + comment.len() <= CARD {
            card.push_str(" / ");
            card.push_str(comment);
        }
        let mut bytes = card.into_bytes();
        bytes.resize(CARD, b' ');
        self.bytes.extend_from_slice(&bytes);
    }

    /// The whole header with END, in blocks.
    pub(super) fn finish(mut self) -> Vec<u8> {
        let mut end = b"END".to_vec();
        end.resize(CARD, b' ');
        self.bytes.extend_from_slice(&end);
        let len = self.bytes.len().next_multiple_of(BLOCK);
        self.bytes.resize(len, b' ');
        self.bytes
    }
}
