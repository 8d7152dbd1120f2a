# gnuplot -c bias.gp FOLDER: draws FOLDER/bias.csv as FOLDER/bias.png.
folder = ARG1
table = folder . "/bias.csv"
set terminal pngcairo size 1260,660 font "DejaVu Sans,14" background rgb "white"
set output folder . "/bias.png"
set datafile separator comma
set logscale xy
set format "10^{%T}"
set xlabel "unbiased samples"
set xrange [1:1e5]
set yrange [3e-4:0.3]
set grid lc rgb "#dddddd"
set key off

set style line 1 lw 1.5 dt 2 lc rgb "#888888" # bound
set style line 2 lw 1.5 dt 3 lc rgb "#d95f02" # balance's bias
set style line 3 lw 2.0 lc rgb "#7570b3"      # best fixed weight
set style line 4 lw 2.5 lc rgb "#d95f02"      # balance
set style line 5 lw 2.5 lc rgb "#1b9e77"      # bias-aware
set style line 6 lw 1.5 lc rgb "#222222"      # best weights
set style line 7 pt 7 ps 0.9 lc rgb "#d95f02"
set style line 8 pt 7 ps 0.9 lc rgb "#1b9e77"

# The rows of one setup.
of(setup, name) = strcol("setup") eq setup ? column(name) : NaN
heading(setup) = setup eq "uniform" ? "unbiased uniform, biased follows f" : \
                 setup eq "divided" ? "each technique good at one end" : \
                 "progressive radius, α = 2/3"

set multiplot
panel = 0
do for [setup in "uniform divided progressive"] {
    set lmargin at screen 0.075 + 0.315 * panel
    set rmargin at screen 0.075 + 0.315 * panel + 0.275
    set bmargin at screen 0.32
    set tmargin at screen 0.93
    set title heading(setup)
    if (panel == 0) { set ylabel "RMS error" } else { unset ylabel; set format y "" }
    plot table using "samples":(of(setup, "bound")) with lines ls 1, \
         "" using "samples":(of(setup, "balance_bias")) with lines ls 2, \
         "" using "samples":(of(setup, "fixed")) with lines ls 3, \
         "" using "samples":(of(setup, "balance")) with lines ls 4, \
         "" using "samples":(of(setup, "aware")) with lines ls 5, \
         "" using "samples":(of(setup, "best")) with lines ls 6, \
         "" using "samples":(of(setup, "balance_simulated")) with points ls 7, \
         "" using "samples":(of(setup, "aware_simulated")) with points ls 8
    panel = panel + 1
}

# The key, below all three.
set lmargin at screen 0.02
set rmargin at screen 0.98
set bmargin at screen 0.01
set tmargin at screen 0.18
unset title
unset ylabel
unset xlabel
unset logscale
unset border
unset tics
unset grid
set key center center horizontal maxrows 3 samplen 2.5
plot [0:1] [0:1] 2 notitle, keyentry with lines ls 4 title "balance", keyentry with points ls 7 title "balance, simulated", \
     keyentry with lines ls 5 title "bias-aware", keyentry with points ls 8 title "bias-aware, simulated", \
     keyentry with lines ls 3 title "best fixed weight", \
     keyentry with lines ls 6 title "best weights in [0, 1]", \
     keyentry with lines ls 2 title "balance: its bias alone", \
     keyentry with lines ls 1 title "square root of the bound"
unset multiplot
