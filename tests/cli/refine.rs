//! Refined meshes.

use std::path::Path;

use idmesh::formats;

use crate::fixture::*;

#[test]
fn refine_writes_a_finer_mesh() {
    let fixture = Fixture::new();
    let input = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join("small.msh.gz");
    let coarse = formats::read(&input).unwrap().mesh;
    for name in ["fine.msh", "fine.su2"] {
        let output = fixture.idmesh(&["refine", input.to_str().unwrap(), name]);
        assert_good(&output);
        assert!(stderr(&output).contains(&format!("wrote {name}: {} tets", 8 * coarse.tets.len())));
        let fine = formats::read(&fixture.path(name)).unwrap().mesh;
        assert_eq!((fine.tets.len(), fine.triangles.len()), (8 * coarse.tets.len(), 4 * coarse.triangles.len()));
        assert_eq!(fine.vertices[..coarse.vertices.len()], coarse.vertices[..]);
        assert_eq!(fine.families, coarse.families);
    }
    fixture.refuses_command(&["refine", "fine.su2", "./fine.su2"], 3, &["would overwrite the input"]);
    fixture.refuses_command(&["refine", "fine.su2", "fine.stl"], 3, &["unknown mesh format"]);
    let mixed = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join("mixed/gmsh.v41.ascii.msh");
    let output = fixture.idmesh(&["refine", mixed.to_str().unwrap(), "x.msh"]);
    assert_good(&output);
    assert!(stderr(&output).contains("wrote x.msh: 12 tets, 6 pyramids, 8 prisms, 8 hexahedra"));
    let fine = formats::read_mixed(&fixture.path("x.msh")).unwrap();
    let coarse = formats::read_mixed(&mixed).unwrap();
    assert_eq!(fine.others.quadrilaterals.len(), 4 * coarse.others.quadrilaterals.len());
}
