# Angles, slider and energies of the slider-crank against time, from trajectory.csv of `costate simulate --csv`.
#   gnuplot -c angles.gp RESULTS OUTPUT.svg
file = ARG1 . "/trajectory.csv"
set terminal svg size 960,360 font "Helvetica,14" background "#ffffff"
set output ARG2
set datafile separator ","
set datafile columnheaders

set xrange [0:10]
set xlabel "time [s]"
set grid lc rgb "#dddddd" lt 1
set key above horizontal samplen 2
set border lc rgb "#555555"
set tics nomirror

set multiplot layout 1,2
set ylabel "angle [rad], position [m]"
plot file using 1:(column("coordinates/crank.angle [rad]")) with lines lw 2 lc rgb "#4a6fa5" title "crank", \
     "" using 1:(column("coordinates/rod.angle [rad]")) with lines lw 2 lc rgb "#c8641e" title "rod", \
     "" using 1:(column("coordinates/rod.x [m]")) with lines lw 2 lc rgb "#222222" title "slider"
set ylabel "energy [J]"
plot file using 1:(column("outputs/energy.kinetic [J]")) with lines lw 2 lc rgb "#4a6fa5" title "kinetic", \
     "" using 1:(column("outputs/energy.potential [J]")) with lines lw 2 lc rgb "#c8641e" title "of the spring"
unset multiplot
