# Spread of the ellipticities (dashed) and of the shear estimates.
load "style.gp"
set xlabel theta_ccd
set ylabel "σ_e (dashed), σ_γ"
set offsets 0.01, 0.01, 0.02, 0.02
set key top left Left reverse
do for [t in "svg pdf png"] {
    eval(out(t, "sigmagamma"))
    plot [0.02:0.30] for [i=1:4] s=word(sets, i) fom("exact", s, "SIGMA_GAMMA SIGMA_GAMMAERR") using 1:2:3 with yerrorlines ls i dt 1 title name(s), \
        for [i=1:4] s=word(sets, i) fom("exact", s, "SIGMA_E") using 1:2 with lines ls i dt 2 lw 1 notitle
}
set output
