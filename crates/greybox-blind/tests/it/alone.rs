//! The generator stands alone.

use cargo_metadata::MetadataCommand;

/// Neither itself nor through others does it use a crate of the workspace: those hold the
/// catalogue's equations.
#[test]
fn law_the_generator_depends_on_no_crate_of_the_workspace() {
    let metadata = MetadataCommand::new()
        .manifest_path(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"))
        // crates of other platforms may have to be fetched first
        .other_options(vec!["--locked".to_owned()])
        .exec()
        .unwrap();
    let members = &metadata.workspace_members;
    let nodes = &metadata.resolve.as_ref().unwrap().nodes;
    let own = metadata.packages.iter().find(|p| p.name.as_str() == "greybox-blind").unwrap();
    assert!(own.publish.as_ref().is_some_and(Vec::is_empty), "not published");
    let mut open = vec![own.id.clone()];
    let mut seen = Vec::new();
    while let Some(id) = open.pop() {
        let node = nodes.iter().find(|node| node.id == id).unwrap();
        for dependency in &node.dependencies {
            assert!(!members.contains(dependency), "depends on {dependency}");
            if !seen.contains(dependency) {
                seen.push(dependency.clone());
                open.push(dependency.clone());
            }
        }
    }
    assert!(seen.len() > 3, "the graph was walked");
}
