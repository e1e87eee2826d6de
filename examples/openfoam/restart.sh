#!/bin/sh
# A flow in OpenFOAM that goes on from the flow of the design before.
#
#     sh examples/openfoam/restart.sh FOLDER
#
# | step | in FOLDER |
# |---|---|
# | the example's mesh becomes an OpenFOAM case, and the flow round it is computed | old |
# | idmesh moves the mesh to the new profiles; checkMesh's own limits must hold | new |
# | the flow round the moved mesh is begun afresh, and from the flow of the old mesh | new, again |
#
# FOLDER is made. IDMESH names the program, ITERATIONS the iterations of the first flow. Needs OpenFOAM
# (Debian, Ubuntu: apt-get install openfoam).
set -eu
[ $# -eq 1 ] || { echo "usage: restart.sh FOLDER" >&2; exit 2; }
examples=$(cd "$(dirname "$0")/.." && pwd)
idmesh=${IDMESH:-idmesh}
iterations=${ITERATIONS:-80}
# Debian's package has its settings here; another installation sets the variable itself.
export WM_PROJECT_DIR="${WM_PROJECT_DIR:-/usr/share/openfoam}"
command -v simpleFoam > /dev/null || { echo "no simpleFoam: apt-get install openfoam" >&2; exit 1; }
mkdir "$1"
cd "$1"
case $PWD in
    *[[:space:]]*) rmdir "$PWD"; echo "OpenFOAM takes no path with a space, as of $PWD" >&2; exit 1 ;;
esac

# The words of checkMesh, the first residual of a flow, and the number of its iterations.
check() { checkMesh -case "$1" > "$1/log.checkMesh" && grep -E 'non-orthogonality Max|Max skewness|Mesh OK|Failed' "$1/log.checkMesh"; }
residual() { sed -n 's/.*Solving for Ux, Initial residual = \([^,]*\),.*/\1/p' "$1/log.simpleFoam" | head -n 1; }
run_to() { sed -i "s/^endTime .*/endTime $2;/; s/^writeInterval .*/writeInterval $2;/" "$1/system/controlDict"; }

cp -R "$examples/openfoam/case" old
"$idmesh" -q convert "$examples/wing-body/wing-body.msh.gz" old/constant/polyMesh
run_to old "$iterations"
echo "the old mesh:"
check old
potentialFoam -case old > old/log.potentialFoam
simpleFoam -case old > old/log.simpleFoam

cp -R "$examples/openfoam/case" new
cp "$examples/wing-body/new.csv" "$examples/wing-body/old.csv" "$examples/openfoam/case.toml" .
"$idmesh" run case.toml --backend "${BACKEND:-auto}" --json report.json -q > idmesh.log
echo "the moved mesh:"
check new
cp -R new again
run_to new 1
run_to again 1
potentialFoam -case new > new/log.potentialFoam
simpleFoam -case new > new/log.simpleFoam

# Cells and faces keep their numbers, so the fields of the old mesh fit the moved one.
cp "old/$iterations/U" "old/$iterations/p" "old/$iterations/phi" again/0/
simpleFoam -case again > again/log.simpleFoam

echo "first residual of Ux: $(residual new) afresh, $(residual again) from the old flow"
