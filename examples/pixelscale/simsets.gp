# The four sets: their pixel scales, charge diffusion, exposures and image scale.
load "style.gp"
scales(s) = sprintf("< awk -v s=%s '$1 == s { print $2, $3 }' %s/dcut.cat", s, dir)
set xlabel theta_ccd
set yrange [0.4:4.9]
set ytics ("Sim 1" 4, "Sim 1\ndrizzled" 3, "Sim 2" 2, "Sim 2\ndrizzled" 1)
unset grid
set grid x lc rgb "#dddddd" lw 0.6
unset key
what(s) = (s eq "sim1" || s eq "sim1d" ? "photosite size; σ_{ch} = ".ch."\"" : "focal length; σ_{ch} = 0.4 θ_{ccd}") \
    .(step(s) < 1 ? "; 4 x 1/4 exposure, half-pixel dithers, θ_s = θ_{ccd}/2" : "; 1 exposure, θ_s = θ_{ccd}")
ch = system(sprintf("cat %s/sim1*-stars.rrg | sed -n 's/^# Keyword: CHDIFF = //p' | head -1", dir))
do for [t in "svg pdf png"] {
    eval(out(t, "simsets"))
    do for [i=1:4] { set label i what(word(sets, i)) at graph 0.02, first 5.28-i font ",10" }
    plot [0.02:0.30] for [i=1:4] s=word(sets, i) scales(s) using 1:(5-i) with points ls i ps 1.2
}
set output
