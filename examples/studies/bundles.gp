# gnuplot -c bundles.gp FOLDER: draws FOLDER/bundles.csv as FOLDER/bundles.png.
folder = ARG1
table = folder . "/bundles.csv"
set terminal pngcairo size 1260,520 font "DejaVu Sans,14" background rgb "white"
set output folder . "/bundles.png"
set datafile separator comma
set logscale xy
set xlabel "seconds of the processor"
set grid lc rgb "#dddddd"
set key top right

set style line 1 lw 2.5 pt 7 ps 1.0 lc rgb "#1b9e77"
set style line 2 lw 2.5 pt 5 ps 1.0 lc rgb "#7570b3"
set style line 3 lw 2.5 pt 9 ps 1.2 lc rgb "#d95f02"

of(scene, method, name) = strcol("scene") eq scene && strcol("method") eq method ? column(name) : NaN
stats table using (column("rms_error")) every ::1 nooutput
set yrange [STATS_min / 1.5:STATS_max * 1.5]

set multiplot layout 1,3
first = 1
do for [scene in "glossy_floor glossy cornell"] {
    set title (scene eq "glossy_floor" ? "glossy floor" : scene eq "glossy" ? "glossy blocks" : "all diffuse")
    if (first) { set ylabel "RMS error, over that of the radiance" } else { unset ylabel }
    first = 0
    plot table using "seconds":(of(scene, "bundles", "rms_error")) with linespoints ls 1 title "ray bundles", \
         "" using "seconds":(of(scene, "paths", "rms_error")) with linespoints ls 2 title "bidirectional paths", \
         "" using "seconds":(of(scene, "both", "rms_error")) with linespoints ls 3 title "both"
}
unset multiplot
