# Cost, gradient and parameters against the evaluations of the optimizer, from evaluations.jsonl of `costate optimize`
# with the parameters L01 and L02.
#   gnuplot -c evaluations.gp RESULTS OUTPUT.svg
# One line an evaluation: index, psi, gradient (2), parameters (2).
number = '([-+0-9.eE]+)'
pair = '\[' . number . ',' . number . '\]'
table = sprintf("< sed -nE 's/.*\"gradient\":%s,\"index\":([0-9]+),\"parameters\":%s.*\"psi\":%s.*/\\3 \\6 \\1 \\2 \\4 \\5/p' '%s/evaluations.jsonl'", pair, pair, number, ARG1)
set terminal svg size 960,400 font "Helvetica,14" background "#ffffff"
set output ARG2

set encoding utf8
set xlabel "evaluation"
set xtics 1
set autoscale xfix
set offsets 0.3, 0.3, 0, 0
set grid lc rgb "#dddddd" lt 1
set key top right
set border lc rgb "#555555"
set tics nomirror

set multiplot layout 1,3
set logscale y
set mytics 1
set format y "10^{%T}"
set title "cost [m² s]"
plot table using 1:2 with linespoints lw 2 pt 7 ps 0.6 lc rgb "#4a6fa5" notitle
set title "size of the gradient [m s]"
plot table using 1:(abs($3)) with linespoints lw 2 pt 7 ps 0.6 lc rgb "#4a6fa5" title "L01", \
     table using 1:(abs($4)) with linespoints lw 2 pt 5 ps 0.6 lc rgb "#c8641e" title "L02"
unset logscale y
set mytics 1
set format y "%g"
set title "natural lengths [m]"
plot table using 1:5 with linespoints lw 2 pt 7 ps 0.6 lc rgb "#4a6fa5" title "L01", \
     table using 1:6 with linespoints lw 2 pt 5 ps 0.6 lc rgb "#c8641e" title "L02"
unset multiplot
