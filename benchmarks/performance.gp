# gnuplot -c performance.gp FOLDER: draws FOLDER/lengths.csv and FOLDER/calls.csv as FOLDER/performance.png.
folder = ARG1
set terminal pngcairo size 1400,560 font "DejaVu Sans,13" background rgb "white"
set output folder . "/performance.png"
set datafile separator comma
set grid lc rgb "#dddddd"
set multiplot layout 1,2

set title "one connection, by length of the path"
set xlabel "vertices of the path"
set ylabel "instructions"
set logscale xy
set xrange [3.5:36]
set yrange [15:8000]
set xtics (4, 8, 16, 32)
set key top left
table = folder . "/lengths.csv"
plot table using "vertices":"by_products" with linespoints lw 2 pt 7 lc rgb "#888888" title "products of all densities", \
     table using "vertices":"by_loop" with linespoints lw 2 pt 5 lc rgb "#d95f02" title "loop over both walks", \
     table using "vertices":"by_three_numbers" with linespoints lw 2 pt 9 lc rgb "#7570b3" title "three numbers per vertex", \
     table using "vertices":"by_two_numbers" with linespoints lw 3 pt 7 lc rgb "#1b9e77" title "two numbers per vertex (mis)"

set title "each call, balance heuristic"
unset logscale
unset xlabel
set xrange [*:*]
set yrange [0:42]
set ylabel "instructions"
set style data histograms
set style histogram clustered gap 1
set style fill solid 0.9 noborder
set xtics autofreq rotate by -35 offset -1,0
set key top right
table = folder . "/calls.csv"
plot table using "three_balance":xtic(1) lc rgb "#7570b3" title "three numbers per vertex", \
     table using "any_balance" lc rgb "#a6dbc8" title "mis, any techniques", \
     table using "known_balance" lc rgb "#1b9e77" title "mis, connected surfaces"
unset multiplot
