# gnuplot -c media.gp FOLDER: FOLDER/media.csv to FOLDER/media.png
folder = ARG1
set terminal pngcairo size 720,420 font "DejaVu Sans,10"
set output folder."/media.png"
set datafile separator ","
set datafile missing NaN
set logscale xy
set xlabel "mean free path, in sizes of the box"
set ylabel "RMS error"
set grid lc rgb "#dddddd"
set key outside right
data = folder."/media.csv"
names = "bpt point-point point-beam beam-point beam-beam upbp"
colors = "#c03020 #c08020 #808020 #208040 #3060b0 #000000"
of(name, value) = strcol(1) eq "box" && strcol(3) eq name ? value : NaN
plot for [k = 1:words(names)] data using 2:(of(word(names, k), $5)) \
     with linespoints lw 2 pt 7 ps 0.7 lc rgb word(colors, k) title word(names, k)
