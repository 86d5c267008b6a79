# style.gp - one look for all figures: colour-blind safe, readable in grey.
# call with: load "style.gp"; start("name")
set encoding utf8
set style line 1 lc rgb "#0072b2" pt 7  ps 0.8 lw 1.6
set style line 2 lc rgb "#56b4e9" pt 6  ps 0.9 lw 1.6 dt 2
set style line 3 lc rgb "#d55e00" pt 5  ps 0.8 lw 1.6
set style line 4 lc rgb "#e69f00" pt 4  ps 0.9 lw 1.6 dt 2
set border lw 1.2
set tics nomirror out
set grid lc rgb "#dddddd" lw 0.6
set key samplen 2 spacing 1.15
set xtics 0.04
svg(name) = sprintf("set terminal svg size 640,440 font 'Helvetica,13' background 'white'; set output '%s/%s.svg'", dir, name)
pdf(name) = sprintf("set terminal pdfcairo size 16cm,11cm font 'Helvetica,11'; set output '%s/%s.pdf'", dir, name)
png(name) = sprintf("set terminal pngcairo size 800,550 font 'Helvetica,12' background 'white'; set output '%s/%s.png'", dir, name)
# a key above all panels
above = "set key at screen 0.5, 0.99 center top horizontal Left reverse samplen 1.5 maxcols 4; set tmargin 7"
# the terminal of a format, and what the figures share
out(format, name) = format eq "svg" ? svg(name) : format eq "pdf" ? pdf(name) : png(name)
sets = "sim1 sim1d sim2 sim2d"
name(s) = s eq "sim1" ? "Sim 1" : s eq "sim1d" ? "Sim 1 drizzled" : s eq "sim2" ? "Sim 2" : "Sim 2 drizzled"
step(s) = s eq "sim1d" || s eq "sim2d" ? 0.5 : 1
fom(v, s, c) = sprintf("< ./pick %s/fom-%s.cat %s CCDSCALE %s", dir, v, s, c)
own(f, s, c) = sprintf("< ./pick %s/%s.cat %s CCDSCALE %s", dir, f, s, c)
theta_ccd = "CCD pixel scale θ_{ccd} / arcsec"
theta_s = "pixel scale of the image θ_s / arcsec"
