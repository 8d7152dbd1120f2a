# gnuplot -c alpha.gp FOLDER: FOLDER/alpha.csv to FOLDER/alpha.png
folder = ARG1
set terminal pngcairo size 900,420 font "DejaVu Sans,10"
set output folder."/alpha.png"
set datafile separator ","
data = folder."/alpha.csv"
set grid lc rgb "#dddddd"
set multiplot layout 1,2

set logscale xy
set xrange [0.9:300]
set yrange [0.004:0.05]
set format y "%g"
set ytics (0.005, 0.01, 0.02, 0.05)
set xlabel "passes"
set ylabel "RMS error"
set key bottom left
alphas = "0.1 0.3 0.5 0.6667 0.8 0.9"
colors = "#9ecae1 #6baed6 #3060b0 #000000 #c08020 #c03020"
plot for [k = 1:words(alphas)] data using 2:(abs($1 - word(alphas, k)) < 1e-3 ? $3 : NaN) \
     with linespoints lw 2 pt 7 ps 0.6 lc rgb word(colors, k) \
     title "α = ".(word(alphas, k) eq "0.6667" ? "2/3" : word(alphas, k))

unset logscale
set xrange [0:1]
set yrange [0:0.42]
set format y "%.2f"
set ytics autofreq
set xlabel "α"
set ylabel "rate: error falls as passes^{−rate}"
set key bottom center
plot (x/2 < 1 - x ? x/2 : 1 - x) with lines lw 2 dt 2 lc rgb "#888888" title "predicted, [H] 19", \
     data using 1:(-$4) with points pt 7 ps 1.2 lc rgb "#3060b0" title "fitted"
unset multiplot
