# Measured against input shear: Sim 1 at 0.10 arcsec, the nine images, with the fit.
load "style.gp"
get(v, c) = real(system(sprintf("./pick %s/fom-%s.cat sim1 CCDSCALE %s | awk '$1 == 0.1 { print $2 }'", dir, v, c)))
points(k) = sprintf("< awk '$1 == \"%s\" { print $2, $3, $4 }' %s/gammaio.cat", k, dir)
set xrange [-0.065:0.065]
set xtics 0.05
set ytics 0.05
set xtics offset 0,0.3
set xlabel offset 0,0.8
set yrange [-0.085:0.085]
set format y "%.2f"
set key top left Left reverse samplen 1
do for [t in "svg pdf png"] {
    eval(out(t, "gammaio"))
    set multiplot layout 2,2 margins 0.14,0.98,0.12,0.92 spacing 0.17,0.22
    do for [v in "exact plain"] { do for [c=1:2] {
        k = sprintf("%d", c); a = get(v, "A".k); sa = get(v, "A".k."SE"); b = get(v, "B".k); sb = get(v, "B".k."SE"); chi = get(v, "CHISQ".k)
        set title v.(v eq "exact" ? " fourth moments" : " fourth moments")
        set label 1 sprintf("a/SE(a) = %.2f\nb = %.3f ± %.3f\nχ^2 = %.2f (7 dof)", a/sa, b, sb, chi) at graph 0.97, 0.32 right font ",9"
        set xlabel sprintf("input g_%d", c)
        set ylabel sprintf("measured γ_%d", c)
        plot x with lines lc rgb "#888888" dt 3 notitle, a+b*x with lines lc rgb "#333333" notitle, points(v.k) using 1:2:3 with yerrorbars ls c notitle
    } }
    unset multiplot
}
set output
