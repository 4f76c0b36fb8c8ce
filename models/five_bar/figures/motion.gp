# The five-bar's motion before and after its optimization, from before.csv and after.csv of `costate optimize`.
#   gnuplot -c motion.gp RESULTS OUTPUT.svg
results = ARG1
set terminal svg size 960,400 font "Helvetica,14" background "#ffffff"
set output ARG2
set datafile separator ","
set datafile columnheaders

X(n) = column(sprintf("coordinates/P%d.x [m]", n))
Y(n) = column(sprintf("coordinates/P%d.y [m]", n))
ax = 0; ay = 0; bx = 1; by = 0  # the bearings A and B
do for [n = 2:3] {  # where the springs' moving ends start
  stats results . "/before.csv" every ::0::0 using (X(n)) name "S" nooutput
  eval sprintf("x%d = S_min", n)
  stats results . "/before.csv" every ::0::0 using (Y(n)) name "S" nooutput
  eval sprintf("y%d = S_min", n)
}

# The springs A-P3 and A-P2 as zigzags of 12 half-waves.
set print $springs
print "x,y"
do for [n = 2:3] {
  dx = (n == 2 ? x2 : x3) - ax; dy = (n == 2 ? y2 : y3) - ay
  l = sqrt(dx**2 + dy**2)
  print sprintf("%g,%g", ax, ay)
  do for [k = 0:12] {
    s = 0.15 + 0.7 * k / 12.0
    side = (k == 0 || k == 12) ? 0 : (k % 2 ? 0.07 : -0.07)
    print sprintf("%g,%g", ax + s * dx - side * dy / l, ay + s * dy + side * dx / l)
  }
  print sprintf("%g,%g", ax + dx, ay + dy)
  print ""
}
set print

set size ratio -1
set xrange [-1.75:2.45]
set yrange [-2.65:0.45]
unset border
unset tics
set palette defined (0 "#440154", 1.25 "#3b528b", 2.5 "#21908d", 3.75 "#5dc963", 5 "#e0c800")
set cbrange [0:5]
set cbtics 1 nomirror scale 0.4
set cblabel "time [s]" offset 1,0
do for [i = 0:1] {
  x = i == 0 ? ax : bx
  set object i+1 polygon from x,0 to x-0.1,-0.16 to x+0.1,-0.16 to x,0 fc rgb "#e6e6e6" fs solid border lc rgb "#555555" behind
}
set label 1 "A" at ax-0.06,ay+0.16 right
set label 2 "B" at bx+0.06,by+0.16 left
set label 3 "P1" at -1.14,-0.95 right
set label 4 "P2" at 0.82,-2.08 left
set label 5 "P3" at 2.14,-0.95 left

ghost = "nohead lw 2 lc rgb '#90aebccb'"
bar = "nohead lw 7 lc rgb '#4a6fa5'"
spring = "with lines lw 1.5 lc rgb '#c8641e' notitle"
pin = "with points pt 7 ps 0.7 lc rgb '#1d2f4a' notitle"

set multiplot
do for [side = 1:2] {
  file = results . (side == 1 ? "/before.csv" : "/after.csv")
  set lmargin at screen (side == 1 ? 0.01 : 0.465)
  set rmargin at screen (side == 1 ? 0.455 : 0.91)
  set tmargin at screen 0.90
  set bmargin at screen 0.02
  set title (side == 1 ? "Before: it swings" : "After: the springs hold it at rest") font ",16" offset 0,-0.3
  if (side == 1) { unset colorbox } else { set colorbox user origin 0.925,0.12 size 0.015,0.7 }
  plot file every 20 using (ax):(ay):(X(1) - ax):(Y(1) - ay) with vectors @ghost notitle, \
       "" every 20 using (X(1)):(Y(1)):(X(2) - X(1)):(Y(2) - Y(1)) with vectors @ghost notitle, \
       "" every 20 using (X(2)):(Y(2)):(X(3) - X(2)):(Y(3) - Y(2)) with vectors @ghost notitle, \
       "" every 20 using (X(3)):(Y(3)):(bx - X(3)):(by - Y(3)) with vectors @ghost notitle, \
       $springs using 1:2 @spring, \
       file every ::0::0 using (ax):(ay):(X(1) - ax):(Y(1) - ay) with vectors @bar notitle, \
       "" every ::0::0 using (X(1)):(Y(1)):(X(2) - X(1)):(Y(2) - Y(1)) with vectors @bar notitle, \
       "" every ::0::0 using (X(2)):(Y(2)):(X(3) - X(2)):(Y(3) - Y(2)) with vectors @bar notitle, \
       "" every ::0::0 using (X(3)):(Y(3)):(bx - X(3)):(by - Y(3)) with vectors @bar notitle, \
       "" every 2 using (X(2)):(Y(2)):1 with lines lw 3 lc palette notitle, \
       for [n = 1:3] "" every ::0::0 using (X(n)):(Y(n)) @pin, \
       "" every ::0::0 using (ax):(ay) @pin, "" every ::0::0 using (bx):(by) @pin
}
unset multiplot
