//! `$PhysicalNames` of old versions of Gmsh: a tag and a name, without a dimension.

use super::*;

fn tet(names: &str) -> String {
    format!(
        "$MeshFormat\n2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1.D0 0 0\n3 0 1 0\n4 0 0 1.5D+00\n$EndNodes\n\
         $Elements\n5\n1 2 2 5 1 1 3 2\n2 2 2 5 1 1 2 4\n3 2 2 6 1 2 3 4\n4 2 2 6 1 1 4 3\n5 4 2 9 1 1 2 3 4\n\
         $EndElements\n$PhysicalNames\n{names}$EndPhysicalNames\n"
    )
}

fn families(names: &str) -> Vec<String> {
    read_bytes("tet.msh", tet(names).as_bytes()).unwrap().mesh.families
}

#[test]
fn names_without_a_dimension_are_the_surfaces() {
    assert_eq!(families("3\n9 \"fluid\"\n6 \"far field\"\n5 \"wing\"\n"), ["far field", "wing"]);
    // Blanks and digits within a name, and a line with a dimension beside others.
    assert_eq!(families("2\n5 \"2 5\"\n2 6 \"far\"\n"), ["2 5", "far"]);
    assert_eq!(families("2\n5 \"wing\"\n3 5 \"fluid\"\n"), ["wing", "surface 6"]);
    // A group without a name stays apart from one that is called like its number.
    assert_eq!(families("1\n2 6 \"surface 5\"\n"), ["surface 5", "surface 5_2"]);
    // A line twice is no contradiction.
    assert_eq!(families("2\n5 \"wing\"\n5 \"wing\"\n"), ["wing", "surface 6"]);
}

/// A volume and a surface with one tag, or a name of each: nothing tells which is which.
#[test]
fn two_names_of_one_tag_are_refused() {
    let error = read_bytes("tet.msh", tet("2\n5 \"wing\"\n5 \"fluid\"\n").as_bytes()).unwrap_err().to_string();
    let expected = "tet.msh:22: expected one name for the physical group 5, or the dimension before each tag, found 'fluid', and \
                    'wing' before";
    assert!(error.ends_with(expected), "{error}");
    let error = read_bytes("tet.msh", tet("1\nwing\n").as_bytes()).unwrap_err().to_string();
    assert!(error.ends_with("expected the dimension of a physical group, found 'wing'"), "{error}");
}
