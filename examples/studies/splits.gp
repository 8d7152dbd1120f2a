# gnuplot -c splits.gp FOLDER: draws FOLDER/splits.csv as FOLDER/splits.png.
folder = ARG1
table = folder . "/splits.csv"
set terminal pngcairo size 1300,500 font "DejaVu Sans,13" background rgb "white"
set output folder . "/splits.png"
set datafile separator comma
set datafile missing NaN # lines go on past what is of other heuristics
set grid lc rgb "#dddddd"
set logscale y
set xrange [0.6:9.4]
set xtics 1
set xlabel "samples of the first technique, of 10"
of(problem, heuristic, value) = strcol("problem") eq problem && strcol("heuristic") eq heuristic ? value : NaN
colors = "#d95f02 #7570b3 #b08020 #a05050"
heuristics = "balance power cutoff maximum"
set format y "10^{%T}"
set multiplot
set tmargin at screen 0.9
set bmargin at screen 0.15
do for [problem in "gaussians low"] {
    name = problem eq "gaussians" ? problem : "low variance"
    set title problem eq "gaussians" ? "two Gaussians, means ±3" : "a nearly perfect first technique"
    set lmargin at screen (problem eq "gaussians" ? 0.075 : 0.47)
    set rmargin at screen (problem eq "gaussians" ? 0.385 : 0.785)
    set ylabel "variance of ten samples"
    # Where f is a sum of the densities, balance has none.
    if (problem eq "gaussians") { set yrange [5e-4:0.3]; set key off } else { set yrange [8e-4:1.5]; set key outside right center reverse Left samplen 2 }
    plot for [k = 1:4] table using "first":(of(name, word(heuristics, k), column("multi_sample"))) \
             with linespoints lw 2.2 pt 7 ps 0.8 lc rgb word(colors, k) title word(heuristics, k), \
         for [k = 1:4] table using "first":(of(name, word(heuristics, k), column("one_sample"))) \
             with linespoints lw 1.6 dt 2 pt 6 ps 0.8 lc rgb word(colors, k) title word(heuristics, k) . ", one-sample"
}
unset multiplot
