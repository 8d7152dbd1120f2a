# gnuplot -c optimal.gp FOLDER: draws FOLDER/optimal.csv as FOLDER/optimal.png.
folder = ARG1
table = folder . "/optimal.csv"
set terminal pngcairo size 1260,1260 font "DejaVu Sans,14" background rgb "white"
set output folder . "/optimal.png"
set datafile separator comma
set logscale xy
set xrange [0.8:1300]
set format x "%g"
set format y "%g"
set xtics (1, 4, 16, 64, 256, 1024)
set grid lc rgb "#dddddd"
set key off

set style line 1 lw 1.5 dt 3 lc rgb "#888888"           # average
set style line 2 lw 2.5 lc rgb "#d95f02"                # balance
set style line 3 lw 2.0 lc rgb "#7570b3"                # power
set style line 4 lw 2.0 dt 2 lc rgb "#b08020"           # cutoff
set style line 5 lw 1.5 dt 4 lc rgb "#a05050"           # maximum
set style line 6 lw 2.0 dt 2 lc rgb "#222222"           # exact alpha
set style line 7 lw 2.0 pt 7 ps 0.7 lc rgb "#1b9e77"    # direct
set style line 8 lw 1.5 pt 6 ps 0.8 lc rgb "#6baed6"    # progressive
set style line 9 lw 2.0 pt 7 ps 0.7 lc rgb "#2050b0"    # progressive from 16
set style line 10 lw 1.5 dt 3 lc rgb "#888888"          # 1 / n

# The rows of one setup.
of(setup, value) = strcol("setup") eq setup ? value : NaN
scaled(setup, name) = of(setup, column(name) * sqrt(column("samples")))
left(column) = 0.085 + 0.325 * column
bottom(row) = 0.73 - 0.335 * row

setups = "gaussians step span mixture duplicate sign"
headings = "'two Gaussians' 'step' 'f in the span of the densities' \
            'third technique mixes two' 'one technique twice' 'f changes sign'"
lowest = "0.3 0.3 0.002 0.25 0.3 0.55"
highest = "2 1.2 6 1.4 1.6 20"

set multiplot
do for [panel = 0:5] {
    setup = word(setups, panel + 1)
    set lmargin at screen left(panel % 3)
    set rmargin at screen left(panel % 3) + 0.25
    set bmargin at screen bottom(panel / 3)
    set tmargin at screen bottom(panel / 3) + 0.235
    set title word(headings, panel + 1)
    set yrange [word(lowest, panel + 1) + 0:word(highest, panel + 1) + 0]
    set xlabel "n"
    if (panel % 3 == 0) { set ylabel "relative RMS error · √n" } else { unset ylabel }
    if (setup eq "span") {
        set label 1 "direct, exact α: 0" at graph 0.05, 0.06
        set ytics auto
    } else {
        unset label 1
        set ytics (0.3, 0.4, 0.5, 0.6, 0.8, 1, 1.5, 2, 3, 5, 10, 20)
    }
    plot table using "samples":(scaled(setup, "average_exact")) with lines ls 1, \
         "" using "samples":(scaled(setup, "maximum_exact")) with lines ls 5, \
         "" using "samples":(scaled(setup, "power_exact")) with lines ls 3, \
         "" using "samples":(scaled(setup, "balance_exact")) with lines ls 2, \
         "" using "samples":(scaled(setup, "cutoff_exact")) with lines ls 4, \
         "" using "samples":(scaled(setup, "known_exact")) with lines ls 6, \
         "" using "samples":(scaled(setup, "progressive")) with linespoints ls 8, \
         "" using "samples":(scaled(setup, "progressive_16")) with linespoints ls 9, \
         "" using "samples":(scaled(setup, "direct")) with linespoints ls 7
}

# The bias of the direct estimator, where it is over 4 standard errors.
bias(setup) = of(setup, abs(column("direct_bias")) > 4 * column("direct_bias_error") ? abs(column("direct_bias")) : NaN)
biased = "gaussians step mixture duplicate sign"
of_bias = "'two Gaussians' step 'third technique mixes two' 'one technique twice' 'f changes sign'"
colors = "#d95f02 #1b9e77 #7570b3 #2050b0 #222222"
set lmargin at screen left(0)
set rmargin at screen left(0) + 0.4
set bmargin at screen bottom(2)
set tmargin at screen bottom(2) + 0.235
set title "bias of direct"
set ylabel "relative bias, absolute"
set yrange [3e-6:30]
set ytics auto
set format y "10^{%T}"
set key top right samplen 1.5
plot 0.3 / x with lines ls 10 title "∝ 1 / n", \
     for [k = 1:words(biased)] table using "samples":(bias(word(biased, k))):"direct_bias_error" \
     with yerrorlines lw 1.5 pt 7 ps 0.6 lc rgb word(colors, k) title word(of_bias, k)

# The key of all other panels, in the last place.
set lmargin at screen 0.55
set rmargin at screen 0.99
unset title
unset ylabel
unset xlabel
unset logscale
unset border
unset tics
unset grid
set key center center vertical maxrows 9 samplen 3 spacing 1.3
plot [0:1] [0:1] 2 notitle, \
     keyentry with lines ls 1 title "average", \
     keyentry with lines ls 5 title "maximum", \
     keyentry with lines ls 3 title "power", \
     keyentry with lines ls 2 title "balance", \
     keyentry with lines ls 4 title "cutoff", \
     keyentry with lines ls 6 title "optimal, exact α: the least", \
     keyentry with linespoints ls 7 title "optimal, direct", \
     keyentry with linespoints ls 8 title "optimal, progressive from n = 1", \
     keyentry with linespoints ls 9 title "optimal, progressive from n = 16"
unset multiplot
