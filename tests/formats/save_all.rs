//! Gmsh files saved with "Save all elements": surfaces, lines and points without a physical group.

use super::*;

/// Two tets. The triangle between them and one outside of them are in no group, and neither are a
/// line and a point.
const V22: &str = "$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
1
2 5 \"wing\"
$EndPhysicalNames
$Nodes
6
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
5 1 1 1
6 9 9 9
$EndNodes
$Elements
13
1 15 2 0 1 1
2 1 2 0 1 1 2
3 2 2 5 1 1 3 2
4 2 2 5 1 1 2 4
5 2 2 5 1 1 4 3
6 2 2 0 99 4 2 3
7 2 2 5 1 2 3 5
8 2 2 5 1 3 4 5
9 2 2 5 1 2 5 4
10 2 2 0 98 1 2 6
11 2 0 4 2 5
12 4 2 0 1 1 2 3 4
13 4 2 9 2 2 3 4 5
$EndElements
";

/// The same in version 4.1.
const V41: &str = "$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
1
2 5 \"wing\"
$EndPhysicalNames
$Entities
1 1 3 2
1 0 0 0 0
1 0 0 0 1 0 0 0 0
1 0 0 0 1 1 1 1 5 0
99 0 0 0 1 1 1 0 0
98 0 0 0 9 9 9 0 0
1 0 0 0 1 1 1 0 0
2 0 0 0 1 1 1 1 9 0
$EndEntities
$Nodes
1 6 1 6
3 1 0 6
1
2
3
4
5
6
0 0 0
1 0 0
0 1 0
0 0 1
1 1 1
9 9 9
$EndNodes
$Elements
7 12 1 12
0 1 15 1
1 1
1 1 1 1
2 1 2
2 1 2 6
3 1 3 2
4 1 2 4
5 1 4 3
7 2 3 5
8 3 4 5
9 2 5 4
2 99 2 1
6 4 2 3
2 98 2 1
10 1 2 6
3 1 4 1
12 1 2 3 4
3 2 4 1
13 2 3 4 5
$EndElements
";

#[test]
fn faces_without_a_group_inside_are_left_out_and_kept_in_the_file() {
    // Version 2.2 may hold a face a second time.
    for text in
        [V22.to_string(), V22.replace("11 2 0 4 2 5\n", "").replace("\n13\n1 15", "\n12\n1 15"), V41.to_string()]
    {
        let file = read_bytes("tets.msh", text.as_bytes()).unwrap();
        assert_eq!(file.mesh.tets, [[0, 1, 2, 3], [1, 2, 3, 4]]);
        let outer = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 4], [2, 3, 4], [1, 4, 3]];
        assert_eq!(file.mesh.triangles, outer);
        assert_eq!(file.mesh.families, ["wing"]);
        assert!(idmesh::mesh::validate(&file.mesh).is_ok());
        assert!(written(&file, "same.msh", &file.mesh.vertices) == text.as_bytes());
        let losses = file.losses(Path::new("a.su2")).unwrap().join("; ");
        assert!(losses.contains(" faces without a group, which are not on the boundary"), "{losses}");
    }
}

#[test]
fn faces_without_a_group_on_the_boundary_are_refused() {
    let message = |text: String| read_bytes("tets.msh", text.as_bytes()).unwrap_err().to_string();
    let refused = message(V22.replace("4 2 2 5 1 1 2 4", "4 2 2 0 1 1 2 4"));
    assert!(refused.contains("1 of 9 triangles belong to no physical group (the first at [0, 0, 0])"), "{refused}");
    // A second volume that is not in the file makes the surface between them a boundary.
    let refused = message(V22.replace("13 4 2 9 2 2 3 4 5\n", "").replace("\n13\n1 15", "\n12\n1 15"));
    assert!(refused.contains("1 of 9 triangles belong to no physical group (the first at [1, 0, 0])"), "{refused}");
    let refused = message(V41.replace("1 0 0 0 1 1 1 1 5 0\n99", "1 0 0 0 1 1 1 0 0\n99"));
    assert!(refused.contains("6 of 8 triangles belong to no physical group (the first on surface 1)"), "{refused}");
    // One that is in a group is the user's: it would be a family of the inside.
    let inside = read_bytes("tets.msh", V22.replace("6 2 2 0 99", "6 2 2 5 99").as_bytes()).unwrap();
    assert!(idmesh::mesh::validate(&inside.mesh).is_err());
}

/// Quadrilaterals between hexahedra.
#[test]
fn faces_between_other_cells_are_left_out_too() {
    let mut nodes = String::new();
    for node in 0..12 {
        nodes += &format!("{} {} {} {}\n", node + 1, node / 4, node / 2 % 2, (node % 4 == 1 || node % 4 == 2) as u8);
    }
    let text = |quadrilateral: &str| {
        format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n12\n{nodes}$EndNodes\n$Elements\n4\n1 3 2 5 1 1 2 3 4\n\
             2 3 2 0 9 {quadrilateral}\n3 5 2 0 1 1 2 3 4 5 6 7 8\n4 5 2 0 1 5 6 7 8 9 10 11 12\n$EndElements\n"
        )
    };
    let between = read_bytes("a.msh", text("6 7 8 5").as_bytes()).unwrap();
    assert_eq!((between.others.hexahedra.len(), &between.others.quadrilaterals[..]), (2, &[[0, 1, 2, 3]][..]));
    let outer = read_bytes("a.msh", text("9 10 11 12").as_bytes()).unwrap_err().to_string();
    assert!(outer.contains("1 of 2 triangles belong to no physical group (the first at [2, 0, 0])"), "{outer}");
}
