# Velocity of point 2 and energies against time, of the design before the optimization: from before.csv of
# `costate optimize`.
#   gnuplot -c time.gp RESULTS OUTPUT.svg
file = ARG1 . "/before.csv"
set terminal svg size 960,400 font "Helvetica,14" background "#ffffff"
set output ARG2
set datafile separator ","
set datafile columnheaders

vx(dummy) = column("velocities/P2.x [m/s]")
vy(dummy) = column("velocities/P2.y [m/s]")
energy(what) = column("outputs/energy." . what . " [J]")

# Energies count from the start.
stats file every ::0::0 using (energy("kinetic")) name "T" nooutput
stats file every ::0::0 using (energy("potential")) name "V" nooutput
set xrange [0:5]
set xlabel "time [s]"
set grid lc rgb "#dddddd" lt 1
set key above horizontal samplen 2
set border lc rgb "#555555"
set tics nomirror

set multiplot layout 1,2
set ylabel "velocity of point 2 [m/s]"
plot file using 1:(vx(0)) with lines lw 2 lc rgb "#4a6fa5" title "x", \
     "" using 1:(vy(0)) with lines lw 2 lc rgb "#c8641e" title "y", \
     "" using 1:(sqrt(vx(0)**2 + vy(0)**2)) with lines lw 1.5 dt 2 lc rgb "#555555" title "speed"
set ylabel "energy, from the start [J]"
plot file using 1:(energy("kinetic") - T_min) with lines lw 2 lc rgb "#4a6fa5" title "kinetic", \
     "" using 1:(energy("potential") - V_min) with lines lw 2 lc rgb "#c8641e" title "potential", \
     "" using 1:(energy("total") - T_min - V_min) with lines lw 2 lc rgb "#222222" title "total"
unset multiplot
