//! What is read is not written over.

use std::{fs, path::Path};

use anyhow::{Result, bail};

/// Refuses products that would take the place of a file that is read, or of one another.
pub(crate) fn refuse<'a>(
    products: &[(&str, Option<&Path>)],
    read: impl IntoIterator<Item = &'a Path>,
) -> Result<()> {
    let named: Vec<(&str, &Path)> =
        products.iter().filter_map(|(option, path)| path.map(|path| (*option, path))).collect();
    for (place, (option, path)) in named.iter().enumerate() {
        if let Some((other, _)) = named[..place].iter().find(|(_, before)| before == path) {
            bail!("`{other}` and `{option}` both write `{}`", path.display());
        }
    }
    // a product that is not there yet is nobody's recording
    let there: Vec<_> = named
        .iter()
        .filter_map(|(option, path)| fs::canonicalize(path).ok().map(|real| (option, path, real)))
        .collect();
    if there.is_empty() {
        return Ok(());
    }
    for file in read {
        let Ok(real) = fs::canonicalize(file) else { continue };
        if let Some((option, path, _)) = there.iter().find(|(.., product)| *product == real) {
            bail!("`{option} {}` would write over a recording that is read", path.display());
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neither_recordings_nor_products_are_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let [a, new] = ["a.csv", "new.json"].map(|name| folder.path().join(name));
        fs::write(&a, "time_s\n").unwrap();
        let around = folder.path().join(".").join("a.csv");
        let refused = |products: &[(&str, Option<&Path>)]| {
            refuse(products, [a.as_path()]).map_err(|error| error.to_string())
        };
        let over = refused(&[("--output", Some(&around)), ("--report", None)]).unwrap_err();
        assert!(over.contains("would write over a recording that is read"), "{over}");
        let both = refused(&[("--output", Some(&new)), ("--report", Some(&new))]).unwrap_err();
        assert!(both.starts_with("`--output` and `--report` both write"), "{both}");
        assert_eq!(refused(&[("--output", Some(&new)), ("--report", None)]), Ok(()));
    }
}
