//! Tables with a row for each value, known by their names.

/// Names of the column that says which channel a value is of, in lower case.
const OF_CHANNELS: [&str; 8] =
    ["variable", "_field", "field", "channel", "signal", "metric", "name", "tag"];
/// Names of the column of values.
const OF_VALUES: [&str; 4] = ["value", "_value", "values", "reading"];

/// Tells whether the columns are those of a table with a row for each value.
pub(crate) fn is_long_form<S: AsRef<str>>(columns: &[S]) -> bool {
    let has = |names: &[&str]| {
        let is_one = |column: &S| names.contains(&column.as_ref().to_lowercase().as_str());
        columns.iter().any(is_one)
    };
    has(&OF_CHANNELS) && has(&OF_VALUES)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_tables_are_known_by_their_names() {
        assert!(is_long_form(&["time_s", "variable", "value"]));
        assert!(is_long_form(&["", "result", "_time", "_value", "_field"]));
        assert!(!is_long_form(&["time_s", "current_a"]));
    }
}
