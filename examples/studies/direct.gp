# gnuplot -c direct.gp FOLDER: FOLDER/direct.csv to FOLDER/direct-errors.png
folder = ARG1
set terminal pngcairo size 900,420 font "DejaVu Sans,10"
set output folder."/direct-errors.png"
set datafile separator ","
set datafile missing NaN
data = folder."/direct.csv"
set logscale y
set xrange [-0.03:0.78]
set yrange [0.003:0.6]
set format y "%g"
set xtics 0.25
set xlabel "share of trained that is spread evenly"
set ylabel "RMS error"
set grid xtics ytics lt 1 lc rgb "#dddddd"
set key bottom right maxrows 3
names = "average balance power maximum progressive optimal"
colors = "#aaaaaa #208040 #c03020 #c08020 #9ecae1 #3060b0"
of(kind, name, value) = strcol(1) eq kind && strcol(3) eq name ? value : NaN
set multiplot layout 1,2
do for [kind in "visibility contribution"] {
    set title "trained by ".kind
    plot for [k = 1:words(names)] data using 2:(of(kind, word(names, k), $4)) \
         with linespoints lw 2 pt 7 ps 0.6 lc rgb word(colors, k) title word(names, k)
    unset key
}
unset multiplot
