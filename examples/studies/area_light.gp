# gnuplot -c area_light.gp FOLDER: draws FOLDER/area_light.csv and FOLDER/area_light_even.csv as FOLDER/area_light.png.
folder = ARG1
table = folder . "/area_light.csv"
even = folder . "/area_light_even.csv"
set terminal pngcairo size 1500,500 font "DejaVu Sans,13" background rgb "white"
set output folder . "/area_light.png"
set datafile separator comma
lg(x) = log10(x)

set xrange [-1:lg(40)]
set yrange [lg(0.003):0]
set xtics ("0.1°" -1, "0.3°" lg(0.3), "1°" 0, "3°" lg(3), "10°" 1, "40°" lg(40)) out nomirror
set ytics ("0.003" lg(0.003), "0.01" -2, "0.03" lg(0.03), "0.1" -1, "0.3" lg(0.3), "1" 0) out nomirror
set xlabel "radius of the light"
set ylabel "roughness of the surface" offset 1
unset key
set tmargin at screen 0.89
set bmargin at screen 0.16

set multiplot
set lmargin at screen 0.07
set rmargin at screen 0.295
set title "BSDF sampling / light sampling"
set palette defined (-4 "#e07000", -2 "#f3bd83", 0 "#f7f7f7", 2 "#8fa8dd", 4 "#2654bd")
set cbrange [-4:4]
set cbtics ("10^{-4}" -4, "0.01" -2, "1" 0, "100" 2, "10^4" 4)
set label 1 "BSDF sampling\nis better" at lg(11), lg(0.007) center front
set label 2 "light sampling\nis better" at lg(0.5), lg(0.3) center front textcolor rgb "white"
plot table skip 1 using (lg($1)):(lg($2)):(lg($8)) with image, \
     even using (lg(column("radius"))):(lg(column("roughness"))) with lines lw 2.5 lc rgb "black"
unset label
set palette defined (-0.3 "#1b7837", 0 "#f7f7f7", 1 "#c994c7", 2 "#762a83")
set cbrange [-0.3:2]
set cbtics ("0.5" lg(0.5), "1" 0, "2" lg(2), "5" lg(5), "10" 1, "30" lg(30), "≥ 100" 2)
do for [k = 0:1] {
    set lmargin at screen 0.395 + 0.325 * k
    set rmargin at screen 0.615 + 0.325 * k
    set title word("balance power", k + 1) . " / the better one alone"
    unset ylabel
    plot table skip 1 using (lg($1)):(lg($2)):(lg(column(9 + k))) with image, \
         even using (lg(column("radius"))):(lg(column("roughness"))) with lines lw 2.5 lc rgb "black"
}
unset multiplot
