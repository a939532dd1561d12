//! The folder that names of recordings share.

/// Bytes that all names have in common up to their last `/`.
pub fn common_folder(names: &[&str]) -> usize {
    let Some((first, rest)) = names.split_first() else { return 0 };
    let folder = first.rfind('/').map_or(0, |at| at + 1);
    let shared = |length: &usize| rest.iter().all(|name| name.starts_with(&first[..*length]));
    let ends = first[..folder].match_indices('/').map(|(at, _)| at + 1);
    ends.rev().find(shared).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_lose_the_folder_they_share() {
        assert_eq!(common_folder(&["a/b/r1.csv", "a/b/r2.csv"]), 4);
        assert_eq!(common_folder(&["a/b/r1.csv", "a/c/r2.csv"]), 2);
        assert_eq!(common_folder(&["a/r1.csv", "b/r2.csv"]), 0);
        assert_eq!(common_folder(&["a/r1.csv"]), 2);
        assert_eq!(common_folder(&["r1.csv", "r1.csv"]), 0);
    }
}
