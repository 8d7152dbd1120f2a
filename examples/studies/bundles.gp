# gnuplot -c bundles.gp FOLDER: draws FOLDER/bundles.csv, of one scene, as FOLDER/bundles.png.
folder = ARG1
table = folder . "/bundles.csv"
set terminal pngcairo size 720,480 font "DejaVu Sans,14" background rgb "white"
set output folder . "/bundles.png"
set datafile separator comma
set logscale xy
set xlabel "seconds of the processor"
set ylabel "RMS error, over that of the radiance"
set xrange [0.2:10]
set ytics (0.02, 0.05, 0.1, 0.2)
set yrange [0.015:0.2]
set grid lc rgb "#dddddd"
set key top right

# Of each time there are three rows, one for each method.
plot table using "seconds":"rms_error" every 3::0 with linespoints lw 2.5 pt 7 ps 1.0 lc rgb "#1b9e77" title "ray bundles", \
     "" using "seconds":"rms_error" every 3::1 with linespoints lw 2.5 pt 5 ps 1.0 lc rgb "#7570b3" title "bidirectional paths", \
     "" using "seconds":"rms_error" every 3::2 with linespoints lw 2.5 pt 9 ps 1.2 lc rgb "#d95f02" title "both"
