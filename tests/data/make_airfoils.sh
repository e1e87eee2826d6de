#!/bin/bash
# Writes the golden files `airfoils/xfoil.*` of tests/airfoil_files.rs: apt-get install xfoil (6.99), bash make_airfoils.sh
#
# NACA 4415 as XFOIL writes it: with a title (SAVE, Selig's order), without one (PSAV), for ISES with the limits of its domain
# (ISAV), for MSES as the first of two elements (MSAV), with other delimiters (DELI), and clockwise (REVE).
#
# `airfoils/lednicer.dat` has no program's origin: it is written here after the description of the format in the UIUC Airfoil
# Coordinates Database, from the points of XFOIL's file and the leading edge.
set -eu
here=$(realpath "$(dirname "$0")")/airfoils
rm -rf "$here"
mkdir "$here"
cd "$here"
xfoil > /dev/null 2> /dev/null <<'E2' || true
PLOP
G

NACA 4415
HALF
HALF
PCOP
SAVE xfoil.labeled.dat
PSAV xfoil.plain.dat
ISAV xfoil.ises.dat
DELI 1
SAVE xfoil.comma.dat
DELI 2
SAVE xfoil.tab.dat
DELI 0
REVE
SAVE xfoil.clockwise.dat
QUIT
E2
# A flap, so that XFOIL replaces the first of two elements.
{ cat xfoil.ises.dat; echo '999. 999.'; tail -n +3 xfoil.ises.dat | awk '{ print 1 + $1 * 0.3, $2 * 0.3 - 0.1 }'; } > xfoil.mses.dat
xfoil > /dev/null 2> /dev/null <<'E2' || true
PLOP
G

LOAD xfoil.mses.dat
1
PCOP
MSAV xfoil.mses.dat
1
QUIT
E2
rm -f :*
awk 'NR > 1 { x[NR - 1] = $1; y[NR - 1] = $2; n = NR - 1 }
    END {
        for (i = 2; i <= n && !below; i++) if (y[i] < 0) below = i
        printf "NACA 4415\n%9.1f %9.1f\n\n", below, n - below + 2
        printf "%10.7f %10.7f\n", 0, 0
        for (i = below - 1; i >= 1; i--) printf "%10.7f %10.7f\n", x[i], y[i]
        printf "\n%10.7f %10.7f\n", 0, 0
        for (i = below; i <= n; i++) printf "%10.7f %10.7f\n", x[i], y[i]
    }' xfoil.labeled.dat > lednicer.dat
