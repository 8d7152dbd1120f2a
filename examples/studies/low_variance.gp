# gnuplot -c low_variance.gp FOLDER: draws FOLDER/low_variance.csv as FOLDER/low_variance.png.
folder = ARG1
table = folder . "/low_variance.csv"
set terminal pngcairo size 1100,520 font "DejaVu Sans,13" background rgb "white"
set output folder . "/low_variance.png"
set datafile separator comma
set grid lc rgb "#dddddd"
set logscale xy
set format x "10^{%T}"
set format y "10^{%T}"
set xlabel "share of the first technique's density that is uniform"
set ylabel "variance of a pass"
set xrange [0.14:0.00007]
set yrange [2e-5:300]
set key outside right center reverse Left samplen 2 spacing 1.3
plot table using "share":"second alone" with linespoints lw 1.5 pt 6 lc rgb "#222222" title "second alone", \
     "" using "share":"average" with linespoints lw 1.5 dt 3 pt 4 lc rgb "#888888" title "average, constant ½", \
     "" using "share":"balance" with linespoints lw 2.5 pt 7 lc rgb "#d95f02" title "balance", \
     "" using "share":"cutoff" with linespoints lw 2 pt 9 lc rgb "#b08020" title "cutoff 0.1", \
     "" using "share":"maximum" with linespoints lw 2 dt 4 pt 5 lc rgb "#a05050" title "maximum", \
     "" using "share":"power" with linespoints lw 2 pt 7 lc rgb "#7570b3" title "power", \
     "" using "share":"first alone" with linespoints lw 2 pt 6 lc rgb "#2050b0" title "first alone"
