#!/bin/bash
# Writes the golden cases `openfoam/*` of tests/formats: apt-get install openfoam (1912), bash make_openfoam.sh
#
# block: blockMesh's hexahedra with wall, symmetry and cyclic patches and a zone, in text, binary and zipped text.
# mixed: gmshToFoam's mesh of `mixed/gmsh.v22.ascii.msh`. tets: of `box.v22.ascii.msh`, mirrored by transformPoints (left-handed),
# divided by decomposePar (a part, and the points of a collated part), renumbered, and its dual of polyhedra.
set -eu
here=$(realpath "$(dirname "$0")")
export WM_PROJECT_DIR=/usr/share/openfoam
work=$(mktemp -d)/case
rm -rf "$here/openfoam"
mkdir -p $work/base/system $work/base/constant "$here/openfoam"
cd $work
dictionary() { echo "FoamFile { version 2.0; format ascii; class dictionary; object $1; }"; cat; }

dictionary controlDict > base/system/controlDict <<'D'
application icoFoam; startFrom startTime; startTime 0; stopAt endTime; endTime 1; deltaT 1; writeControl timeStep; writeInterval 1;
writeFormat ascii; writePrecision 12; writeCompression off; timeFormat general;
D
dictionary fvSchemes > base/system/fvSchemes <<'D'
ddtSchemes { default Euler; } gradSchemes { default Gauss linear; } divSchemes { default none; }
laplacianSchemes { default Gauss linear corrected; } interpolationSchemes { default linear; } snGradSchemes { default corrected; }
D
dictionary fvSolution > base/system/fvSolution <<'D'
solvers {} PISO {}
D
dictionary blockMeshDict > base/system/blockMeshDict <<'D'
convertToMeters 0.1;
vertices ((0 0 0) (2 0 0) (2 1 0) (0 1 0) (0 0 1) (2 0 1) (2 1 1) (0 1 1));
blocks (hex (0 1 2 3 4 5 6 7) fluid (3 2 1) simpleGrading (2 1 1));
edges ();
boundary (
    inlet { type patch; faces ((0 4 7 3)); }
    outlet { type patch; faces ((2 6 5 1)); }
    wing { type wall; faces ((1 5 4 0)); }
    top { type symmetryPlane; faces ((3 7 6 2)); }
    left { type cyclic; neighbourPatch right; faces ((0 3 2 1)); }
    right { type cyclic; neighbourPatch left; faces ((4 5 6 7)); }
);
D
dictionary decomposeParDict > base/system/decomposeParDict <<'D'
numberOfSubdomains 2; method simple; simpleCoeffs { n (2 1 1); delta 0.001; }
D

# Rewrites a copy of a case: `converted FROM TO FORMAT COMPRESSION`.
converted() {
    cp -r "$1" "$2"
    sed -i "s/writeFormat ascii/writeFormat $3/; s/writeCompression off/writeCompression $4/" "$2/system/controlDict"
    (cd "$2" && foamFormatConvert -constant)
}
from_gmsh() {
    cp -r base "$1"
    cp "$here/$2" "$1/a.msh"
    (cd "$1" && gmshToFoam a.msh)
}
{
    cp -r base block
    (cd block && blockMesh)
    converted block block.binary binary off
    converted block block.gz ascii on
    from_gmsh mixed mixed/gmsh.v22.ascii.msh
    from_gmsh tets box.v22.ascii.msh
    cp -r tets mirror && (cd mirror && transformPoints -scale '(1 -1 1)')
    converted mirror mirrored.gz ascii on
    cp -r tets order && (cd order && renumberMesh -overwrite)
    converted order renumbered binary off
    cp -r tets dual && (cd dual && polyDualMesh 45 -overwrite)
    converted dual polyhedra.gz ascii on
    cp -r tets part && (cd part && decomposePar)
    cp -r tets collated && (cd collated && decomposePar -fileHandler collated)
} > $work/log 2>&1 || { tail $work/log; exit 1; }
for case in block block.binary block.gz mixed mirrored.gz renumbered polyhedra.gz; do
    mkdir -p "$here/openfoam/$case"
    cp $case/constant/polyMesh/* "$here/openfoam/$case" 2> /dev/null || true
done
mkdir -p "$here/openfoam/processor0/constant/polyMesh" "$here/openfoam/collated"
cp part/processor0/constant/polyMesh/* "$here/openfoam/processor0/constant/polyMesh" 2> /dev/null || true
gzip -9n "$here"/openfoam/processor0/constant/polyMesh/*
cp collated/processors2/constant/polyMesh/points "$here/openfoam/collated"
for case in block mixed mirror order dual; do
    (cd $case && checkMesh | grep -E '^ +(points|faces|cells|hexahedra|prisms|pyramids|tetrahedra|polyhedra): +[1-9]' | tr -s ' \n' ' ')
    echo "$case"
done
rm -r $work
