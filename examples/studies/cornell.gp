# gnuplot -c cornell.gp FOLDER: FOLDER/cornell.csv to FOLDER/cornell.png
folder = ARG1
set terminal pngcairo size 900,420 font "DejaVu Sans,10"
set output folder."/cornell.png"
set datafile separator ","
set logscale xy
set format x "10^{%T}"
set format y "%g"
set xlabel "processor time, s"
set ylabel "RMS error"
set grid lc rgb "#dddddd"
set key bottom left
data = folder."/cornell.csv"
names = "bpt ppm sppm ups ups~1"
colors = "#c03020 #c08020 #808020 #3060b0 #208040"
of(scene, name, value) = strcol(1) eq scene && strcol(2) eq name ? value : NaN
spaced(name) = name eq "ups~1" ? "ups 1" : name
set multiplot layout 1,2
do for [scene in "caustic diffuse"] {
    set title "scene ".scene
    plot for [k = 1:words(names)] data using 4:(of(scene, spaced(word(names, k)), $5)) \
         with linespoints lw 2 pt 7 ps 0.5 lc rgb word(colors, k) title spaced(word(names, k))
}
unset multiplot
