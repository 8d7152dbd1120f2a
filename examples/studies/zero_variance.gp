# gnuplot -c zero_variance.gp FOLDER: draws FOLDER/zero_variance.csv and zero_variance_walks.csv as zero_variance.png.
folder = ARG1
table = folder . "/zero_variance.csv"
along = folder . "/zero_variance_walks.csv"
set terminal pngcairo size 1150,900 font "DejaVu Sans,11" background rgb "white"
set output folder . "/zero_variance.png"
set datafile separator comma
set grid back lc rgb "#cccccc" lt 1
set key off
set style fill transparent solid 0.25 noborder

name(i) = i == 1 ? "analogue" : i == 2 ? "exact" : i == 3 ? "window 2" : i == 4 ? "window 5" : i == 5 ? "window 20" : \
          i == 6 ? "directions" : "zero variance"
title_of(i) = i == 2 ? "exact rates" : i == 6 ? "exact rates, directions too" : name(i)
array color[7] = ["#222222", "#d95f02", "#1b9e77", "#7570b3", "#a6761d", "#e7298a", "#3060b0"]
do for [i=1:7] {
    set style line i lw 2.2 lc rgb color[i]
    set style line 10+i pt 7 ps 0.7 lc rgb color[i]
}
of(i, column_name) = strcol("walk") eq name(i) ? column(column_name) : NaN
# Lines go on over rows of other walks.
set datafile missing NaN

set multiplot
set lmargin at screen 0.075
set rmargin at screen 0.485
set tmargin at screen 0.955
set bmargin at screen 0.585
set xrange [0:20]
set xlabel "length of the rod (mean free paths)"
set logscale y
set format y "10^{%T}"
set yrange [0.3:1e6]
set title "variance of one walk / I^2: lines the equation, dots 100,000 walks"
plot for [i=1:6] table using (column("length")):(of(i, "variance")) with lines ls i, \
     for [i=1:6] "" using (column("length")):(of(i, "simulated_variance")) with points ls 10+i

set lmargin at screen 0.565
set rmargin at screen 0.975
unset logscale y
set format y "%g"
set yrange [0:12]
set title "cost of one walk: collisions"
plot for [i=1:7] table using (column("length")):(of(i, "collisions")) with lines ls i, \
     for [i=1:7] "" using (column("length")):(of(i, "simulated_collisions")) with points ls 10+i

set lmargin at screen 0.075
set rmargin at screen 0.485
set tmargin at screen 0.485
set bmargin at screen 0.155
set logscale y
set yrange [0.8:200]
set title "efficiency over the analogue walk"
plot for [i=1:6] table using (column("length")):(of(i, "gain")) with lines ls i

set lmargin at screen 0.565
set rmargin at screen 0.975
set xlabel "depth (mean free paths), rod of length 20"
set format y "10^{%T}"
set yrange [0.05:1e4]
set title "weight times adjoint / I after each collision: 5 %, 50 %, 95 %"
plot for [i in "5 4 3"] along using (column("depth")):(of(i+0, "low")):(of(i+0, "high")) with filledcurves lc rgb color[i+0] , \
     for [i=1:1] "" using (column("depth")):(of(i, "low")):(of(i, "high")) with filledcurves lc rgb color[i], \
     for [i=1:5] "" using (column("depth")):(of(i, "median")) with lines ls i, \
     "" using (column("depth")):(of(7, "median")) with lines ls 7 dt 2

# The key, below all.
set lmargin at screen 0.02
set rmargin at screen 0.98
set bmargin at screen 0.0
set tmargin at screen 0.085
unset title
unset xlabel
unset logscale
unset border
unset tics
unset grid
set yrange [0:1]
set xrange [0:1]
set key center center vertical maxrows 2 samplen 2.5 width 0
plot 2 notitle, for [i=1:7] keyentry with lines ls i title title_of(i)
unset multiplot
