# gnuplot -c scale.gp FOLDER: FOLDER/scale.csv to FOLDER/scale.png
folder = ARG1
set terminal pngcairo size 640,360 font "DejaVu Sans,10"
set output folder."/scale.png"
set datafile separator ","
set logscale x 10
set format x "10^{%T}"
set xlabel "size of the scene"
set ylabel "mean weight of merges"
set yrange [0:0.65]
set key top right
data = folder."/scale.csv"
in_double(column) = strcol(1) eq "double" ? column : NaN
plot data using 2:(in_double($7)) with linespoints lw 2 pt 7 lc rgb "#c03020" title "without the area (wrong)", \
     data using 2:(in_double($3)) with linespoints lw 2 pt 7 lc rgb "#3060b0" title "merges times {/Symbol p} r^2", \
     data using 2:(in_double($5)) with points pt 6 ps 2 lw 2 lc rgb "#208040" title "all others divided by {/Symbol p} r^2"
