# Standard error of the mean shear of a square arcminute.
load "style.gp"
set xlabel theta_ccd
set ylabel "σ_γ n^{-1/2} / arcmin"
set offsets 0.01, 0.01, 0, 0
set key top left Left reverse
do for [t in "svg pdf png"] {
    eval(out(t, "stderr"))
    plot [0.02:0.30] for [i=1:4] s=word(sets, i) own("errors-exact", s, "STDERR STDERRERR") using 1:2:3 with yerrorlines ls i title name(s)
}
set output
