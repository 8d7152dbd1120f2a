# gnuplot -c allocation.gp FOLDER: FOLDER/allocation_map.csv and FOLDER/allocation_path.csv to FOLDER/allocation.png,
# FOLDER/allocation_pilots.csv to FOLDER/allocation-pilots.png
folder = ARG1
set datafile separator comma
set datafile missing NaN
ratios = "1 10 100"
map = folder . "/allocation_map.csv"
path = folder . "/allocation_path.csv"
table = folder . "/allocation.csv"
pilots = folder . "/allocation_pilots.csv"

# Shares as places in a triangle: uniform at its left corner, right at its right one, left at the top.
px(left, right) = right + left / 2
py(left) = left * sqrt(3) / 2
set terminal pngcairo size 1500,560 font "DejaVu Sans,14" background rgb "white"
set output folder . "/allocation.png"
set palette defined (0 "#173f6b", 0.12 "#2f6ea5", 0.3 "#7fb2d5", 0.55 "#dfe8ec", 0.8 "#f0c08a", 1 "#c05a10")
set logscale cb
set cbrange [1:30]
set colorbox user origin 0.905,0.17 size 0.015,0.62
set cblabel "variance over the least" offset 0.5,0
unset border
unset tics
set cbtics (1, 2, 5, 10, "≥ 30" 30)
set xrange [-0.12:1.12]
set yrange [-0.12:0.98]
set key off
set multiplot
do for [k = 1:3] {
    ratio = word(ratios, k) + 0
    set lmargin at screen 0.005 + 0.295 * (k - 1)
    set rmargin at screen 0.3 + 0.295 * (k - 1)
    set tmargin at screen 0.88
    set bmargin at screen 0.12
    if (k == 2) { unset colorbox }
    stats table using ($1 == ratio ? $3 : NaN) nooutput name "found"
    set title sprintf("a sample for a peak costs %d", ratio) offset 0,0.5
    if (k == 1) {
        set label 4 "□  equal counts      ✕  the counts found      dots: each step from equal counts, Newton's (red) and projected gradients (dark)" \
            at screen 0.45,0.05 center
    } else { unset label 4 }
    set label 1 "uniform" at 0.02,-0.06 center
    set label 2 "right peak" at 0.93,-0.06 center
    set label 3 "left peak" at 0.5,0.92 center
    plot map using ($1 == ratio ? px($2, $3) : NaN):(py($2)):($4 / found_min) with points pt 7 ps 0.28 palette, \
         path using ($1 == ratio && strcol(2) eq "gradient" ? px($4, $5) : NaN):(py($4)) \
            with linespoints lw 2 pt 7 ps 0.6 lc rgb "#222222", \
         path using ($1 == ratio && strcol(2) eq "newton" ? px($4, $5) : NaN):(py($4)) \
            with linespoints lw 2.5 pt 7 ps 0.8 lc rgb "#d4145a", \
         path using ($1 == ratio && strcol(2) eq "equal" ? px($4, $5) : NaN):(py($4)) with points pt 4 ps 2 lw 3 lc rgb "black", \
         path using ($1 == ratio && strcol(2) eq "found" ? px($4, $5) : NaN):(py($4)) with points pt 2 ps 2.4 lw 4 lc rgb "black"
}
unset multiplot

set output folder . "/allocation-pilots.png"
set terminal pngcairo size 1500,480 font "DejaVu Sans,14" background rgb "white"
unset label
unset title
set border
set grid lc rgb "#dddddd"
set logscale xy
set xrange [5:4000]
set yrange [0.98:30]
set xtics (6, 12, 25 24, 50 48, 100 99, 200 198, 500 501, 3000)
set ytics (1, 1.1 1.1, 1.5 1.5, 2, 3, 5, 10, 20)
set xlabel "pilot samples"
set multiplot
do for [k = 1:3] {
    ratio = word(ratios, k) + 0
    set lmargin at screen 0.06 + 0.32 * (k - 1)
    set rmargin at screen 0.34 + 0.32 * (k - 1)
    set tmargin at screen 0.9
    set bmargin at screen 0.16
    set ylabel (k == 1 ? "variance over the least" : "")
    set title sprintf("a sample for a peak costs %d", ratio)
    if (k == 3) { set key at graph 0.98,0.5 samplen 2 opaque } else { set key off }
    plot pilots using 2:(column(1) == ratio ? column(6) : NaN) with lines lw 2 dt 2 lc rgb "#555555" title "equal counts", \
         "" using 2:(column(1) == ratio && column(3) == 0 ? column(5) : NaN) with linespoints lw 2 dt 3 pt 6 lc rgb "#c03020" title "95 % of pilots are below", \
         "" using 2:(column(1) == ratio && column(3) == 0 ? column(4) : NaN) with linespoints lw 2.5 pt 7 lc rgb "#c03020" title "median", \
         "" using 2:(column(1) == ratio && column(3) > 0 ? column(5) : NaN) with linespoints lw 2 dt 3 pt 6 lc rgb "#3060b0" title "95 %, least share 5 %", \
         "" using 2:(column(1) == ratio && column(3) > 0 ? column(4) : NaN) with linespoints lw 2.5 pt 7 lc rgb "#3060b0" title "median, least share 5 %"
}
unset multiplot
