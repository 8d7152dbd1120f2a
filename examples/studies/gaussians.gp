# gnuplot -c gaussians.gp FOLDER: draws FOLDER/gaussians.csv and FOLDER/gaussians_curves.csv as FOLDER/gaussians.png.
folder = ARG1
curves = folder . "/gaussians_curves.csv"
table = folder . "/gaussians.csv"
set terminal pngcairo size 1400,860 font "DejaVu Sans,13" background rgb "white"
set output folder . "/gaussians.png"
set datafile separator comma
set grid lc rgb "#dddddd"

of(setup, value) = strcol("setup") eq setup ? value : NaN
# Of 0, rounding is left.
least = 1e-4
shown(variance) = variance < least ? least : variance

set multiplot
do for [row = 0:1] {
    setup = word("far near", row + 1)
    set bmargin at screen 0.635 - 0.5 * row
    set tmargin at screen 0.95 - 0.5 * row
    unset logscale
    unset xtics
    set xtics
    set xrange [-22:22]
    set format y "%g"

    set lmargin at screen 0.06
    set rmargin at screen 0.32
    set title (row == 0 ? "means ±8: integrand and densities" : "means ±3: integrand and densities")
    set yrange [0:*]
    set key top left reverse Left samplen 1.5
    plot curves using "x":(of(setup, column("f"))) with filledcurves y1=0 lc rgb "#dddddd" title "f", \
         "" using "x":(of(setup, column("first"))) with lines lw 2 lc rgb "#d95f02" title "p₁", \
         "" using "x":(of(setup, column("second"))) with lines lw 2 lc rgb "#7570b3" title "p₂"

    set lmargin at screen 0.37
    set rmargin at screen 0.64
    set title "weight of a sample of p₁"
    set yrange [-0.05:1.05]
    set key bottom left reverse Left samplen 1.5
    plot curves using "x":(of(setup, column("average"))) with lines lw 1.5 dt 3 lc rgb "#888888" title "average", \
         "" using "x":(of(setup, column("balance"))) with lines lw 2.5 lc rgb "#d95f02" title "balance", \
         "" using "x":(of(setup, column("power"))) with lines lw 2 lc rgb "#7570b3" title "power", \
         "" using "x":(of(setup, column("cutoff"))) with lines lw 2 dt 2 lc rgb "#b08020" title "cutoff 0.1", \
         "" using "x":(of(setup, column("maximum"))) with lines lw 1.5 dt 4 lc rgb "#a05050" title "maximum", \
         "" using "x":(of(setup, column("optimal"))) with lines lw 2 lc rgb "#1b9e77" title "optimal"

    set lmargin at screen 0.70
    set rmargin at screen 0.985
    set title "variance of a pass"
    set key off
    set logscale y
    set format y "10^{%T}"
    set yrange [0.5 * least:2e7]
    set xrange [0.3:9.7]
    set boxwidth 0.7
    set style fill solid 0.85 noborder
    set xtics ("first" 1, "second" 2, "constant" 3, "average" 4, "balance" 5, "power" 6, "cutoff" 7, "maximum" 8, "optimal" 9) \
        rotate by -45 offset -0.7,0
    first = row * 9
    plot table using (column(0) + 1 - first):(of(setup, shown(column("variance")))) with boxes lc rgb "#9ecae1", \
         "" using (column(0) + 1 - first):(column("seen") > 0 ? of(setup, shown(column("measured"))) : NaN) with points pt 7 ps 0.9 lc rgb "#222222"
}
unset multiplot
