#!/bin/sh
# A loop of designs with SU2's file names, in which idmesh takes the place of SU2_DEF.
#
#     su2.sh STEPS               in a folder with case.toml, surface_original.dat and config.cfg
#
# | file | what it is |
# |---|---|
# | mesh.su2 | the undeformed mesh, which case.toml names |
# | surface_original.dat | vertices of the moved marker and their positions: index x y z |
# | surface_positions.dat | vertices and their new positions, as SU2_DEF reads them; made here |
# | mesh_out.su2 | the moved mesh, which config.cfg names |
# | history.NUMBER.csv | what SU2_CFD tells of each design |
# | report.NUMBER.json, idmesh.NUMBER.log | what idmesh tells of each design |
#
# The parametrisation below bends the wing up. Put your own in its place: it writes
# surface_positions.dat for a design variable.
#
# SU2_CFD names the flow solver. BACKEND is auto, gpu or cpu.
set -eu
steps=$1
solver=${SU2_CFD:-SU2_CFD}

parametrise() {
    awk -v bend="$1" '!/^#/ && NF >= 4 { printf "%d %.17g %.17g %.17g\n", $1, $2, $3, $4 + bend * $3 * $3 }' \
        surface_original.dat > surface_positions.dat
}

number=1
while [ "$number" -le "$steps" ]; do
    bend=$(awk -v number="$number" -v steps="$steps" 'BEGIN { print 0.05 * number / steps }')
    # A mesh that is not valid is not named mesh_out.su2: no flow is computed on it. A solver that
    # fails stops the loop too.
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
    "$solver" config.cfg
    mv history.csv "history.$number.csv"
    echo "design $number: bend $bend"
    number=$((number + 1))
done
