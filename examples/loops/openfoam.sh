#!/bin/sh
# A loop of designs in an OpenFOAM case, as DAFoam lays it out: each design rewrites
# constant/polyMesh/points, and the solver starts from the fields of the design before.
#
#     openfoam.sh STEPS          in the case's folder, with case.toml and surface_original.csv
#
# | file | what it is |
# |---|---|
# | base/polyMesh | the undeformed mesh, which case.toml names; copied at the start from constant/polyMesh |
# | surface_original.csv | positions of the moved patch: x,y,z |
# | surface.csv | positions and their displacement, x,y,z,dx,dy,dz; made here |
# | constant/polyMesh/points | the moved points, which case.toml names as its output |
# | objective.NUMBER | what the solver tells of each design |
# | report.NUMBER.json, idmesh.NUMBER.log | what idmesh tells of each design |
#
# Every design is moved from the undeformed mesh, so no error adds up, whatever the number of designs.
# The parametrisation below bends the wing up. Put your own in its place.
#
# SOLVER names the flow solver. BACKEND is auto, gpu or cpu.
set -eu
steps=$1
solver=${SOLVER:-simpleFoam}

parametrise() {
    awk -F, -v bend="$1" 'BEGIN { print "x,y,z,dx,dy,dz" }
        $1 != "x" && NF >= 3 { printf "%s,%s,%s,0,0,%.17g\n", $1, $2, $3, bend * $2 * $2 }' \
        surface_original.csv > surface.csv
}

if [ ! -d base/polyMesh ]; then
    mkdir -p base
    # A copy that is not whole has another name.
    rm -rf base/copy
    cp -R constant/polyMesh base/copy
    mv base/copy base/polyMesh
fi
number=1
while [ "$number" -le "$steps" ]; do
    bend=$(awk -v number="$number" -v steps="$steps" 'BEGIN { print 0.05 * number / steps }')
    while :; do
        parametrise "$bend"
        status=0
        idmesh run case.toml --backend "${BACKEND:-auto}" --json "report.$number.json" -q > "idmesh.$number.log" || status=$?
        case $status in
            0) break ;;
            # Beyond the reach of the mesh: half the way.
            4 | 5) bend=$(awk -v bend="$bend" 'BEGIN { print bend / 2 }') ;;
            *) exit "$status" ;;
        esac
    done
    "$solver" > "objective.$number"
    echo "design $number: bend $bend"
    number=$((number + 1))
done
