//! Columns of a table, wherever they come from.

use fdi_core::SharedNumbers;

/// Numbers with gaps.
#[derive(Clone, Debug)]
pub(crate) struct Numbers {
    pub(crate) values: SharedNumbers,
    /// Which of them are there; `None` where all are.
    pub(crate) present: Option<Vec<bool>>,
    /// True where they were held in single precision.
    pub(crate) single: bool,
}

impl Numbers {
    pub(crate) fn of(values: SharedNumbers) -> Self {
        Self { values, present: None, single: false }
    }

    /// Takes numbers that are not a number for gaps.
    pub(crate) fn without_nan(mut self) -> Self {
        if self.values.iter().any(|value| value.is_nan()) {
            let is_there = |(place, value): (usize, &f64)| {
                !value.is_nan() && self.present.as_ref().is_none_or(|present| present[place])
            };
            self.present = Some(self.values.iter().enumerate().map(is_there).collect());
        }
        self
    }

    /// Numbers of a range of rows, shared.
    pub(crate) fn slice(&self, from: usize, to: usize) -> Self {
        let present = self.present.as_ref().map(|present| present[from..to].to_vec());
        let values = if (from, to) == (0, self.values.len()) {
            self.values.clone()
        } else {
            SharedNumbers::of(Rows { all: self.values.clone(), from, to })
        };
        Self { values, present: present.filter(|present| present.contains(&false)), ..*self }
    }

    /// Numbers of some rows.
    pub(crate) fn of_rows(&self, rows: &[usize]) -> Self {
        let is_run = rows.windows(2).all(|pair| pair[1] == pair[0] + 1);
        if let (true, Some(&first)) = (is_run, rows.first()) {
            return self.slice(first, first + rows.len());
        }
        let present = self.present.as_ref().map(|all| rows.iter().map(|&row| all[row]).collect());
        Self { values: rows.iter().map(|&row| self.values[row]).collect(), present, ..*self }
    }

    /// The first row without a number.
    pub(crate) fn first_gap(&self) -> Option<usize> {
        (0..self.values.len()).find(|&row| self.at(row).is_none_or(f64::is_nan))
    }

    /// The number of a row, where it is there.
    pub(crate) fn at(&self, row: usize) -> Option<f64> {
        let is_there = self.present.as_ref().is_none_or(|present| present[row]);
        is_there.then(|| self.values[row])
    }

    /// One after another; a single part is shared.
    pub(crate) fn joined(mut parts: Vec<Self>) -> Self {
        if parts.len() == 1 {
            return parts.remove(0);
        }
        let has_gaps = parts.iter().any(|part| part.present.is_some());
        let present =
            |part: &Self| part.present.clone().unwrap_or_else(|| vec![true; part.values.len()]);
        Self {
            values: parts.iter().flat_map(|part| part.values.iter().copied()).collect(),
            present: has_gaps.then(|| parts.iter().flat_map(present).collect()),
            single: parts.iter().any(|part| part.single),
        }
    }
}

/// Some rows of numbers that others hold.
struct Rows {
    all: SharedNumbers,
    from: usize,
    to: usize,
}

impl AsRef<[f64]> for Rows {
    fn as_ref(&self) -> &[f64] {
        &self.all[self.from..self.to]
    }
}

/// Cells of a column.
#[derive(Clone, Debug)]
pub(crate) enum Cells {
    Numbers(Numbers),
    Texts(Vec<Option<String>>),
    /// Numbers in each row.
    Lists(Vec<Option<Numbers>>),
    /// Contents of files.
    Files(Vec<Option<Vec<u8>>>),
    /// Anything else: kept, and ignored.
    Other {
        rows: usize,
        what: String,
    },
}

impl Cells {
    pub(crate) fn rows(&self) -> usize {
        match self {
            Self::Numbers(numbers) => numbers.values.len(),
            Self::Texts(texts) => texts.len(),
            Self::Lists(lists) => lists.len(),
            Self::Files(files) => files.len(),
            Self::Other { rows, .. } => *rows,
        }
    }

    /// Kind of the cells, in words.
    pub(crate) fn what(&self) -> &str {
        match self {
            Self::Numbers(_) => "numbers",
            Self::Texts(_) => "text",
            Self::Lists(_) => "lists",
            Self::Files(_) => "files",
            Self::Other { what, .. } => what,
        }
    }

    /// The cell of a row as a text, a whole number without a point.
    pub(crate) fn text(&self, row: usize) -> Option<String> {
        match self {
            Self::Texts(texts) => texts[row].clone(),
            Self::Numbers(numbers) => numbers.at(row).map(|number| number.to_string()),
            _ => None,
        }
    }

    /// One after another.
    pub(crate) fn joined(mut parts: Vec<Self>) -> Self {
        if parts.len() == 1 {
            return parts.remove(0);
        }
        let rows = parts.iter().map(Self::rows).sum();
        let (mut numbers, mut texts) = (Vec::new(), Vec::new());
        let (mut lists, mut files) = (Vec::new(), Vec::new());
        let mut what = None;
        for part in parts {
            match part {
                Self::Numbers(part) => numbers.push(part),
                Self::Texts(part) => texts.extend(part),
                Self::Lists(part) => lists.extend(part),
                Self::Files(part) => files.extend(part),
                Self::Other { what: told, .. } => what = Some(told),
            }
        }
        if !numbers.is_empty() {
            return Self::Numbers(Numbers::joined(numbers));
        }
        match (texts.len(), lists.len(), files.len(), what) {
            (1.., ..) => Self::Texts(texts),
            (_, 1.., ..) => Self::Lists(lists),
            (_, _, 1.., _) => Self::Files(files),
            (.., what) => Self::Other { rows, what: what.unwrap_or_else(|| "nothing".to_owned()) },
        }
    }
}

/// A column with its name.
#[derive(Clone, Debug)]
pub(crate) struct Column {
    pub(crate) name: String,
    pub(crate) cells: Cells,
}
