#!/usr/bin/perl
# fits.pl - make and read small FITS images without any FITS library.
#   fits.pl make OUT NX NY 'EXPR of $x $y' [CARD...]      float32 primary; x, y count from 0
#   fits.pl add  OUT NX NY EXPR [CARD...]                 append an image extension (NX 0: header only)
#   fits.pl dump FILE HDU                                 "x y value" lines, x and y from 0
#   fits.pl stat FILE HDU                                 "mean variance min max n sum", blanks left out
#   fits.pl card FILE HDU KEY                             value of a keyword
#   fits.pl count FILE                                    number of HDUs
use strict; use warnings;
my ($do, $file, @a) = @ARGV;
sub block { my ($s, $pad) = @_; my $n = length($s) % 2880; return $n ? $s . $pad x (2880 - $n) : $s }
sub hdus {
    local $/; open my $f, '<:raw', $file or die "$file: $!"; my $d = <$f>; my ($at, @h) = (0);
    while ($at < length $d) {
        my ($start, %k) = ($at);
        for (;;) { my $c = substr $d, $at, 80; die "$file: no END" if length $c < 80; $at += 80; last if $c =~ /^END */;
            $k{$1} = $2 if $c =~ /^(\S+) *= (?:('(?:[^']|'')*')|[^\/]*)/ && ($2 // '') ne '' && !exists $k{$1};
            $k{$1} = $2 if $c =~ /^(\S+) *= *([^'\/ ][^\/ ]*)/ && !exists $k{$1}; }
        $at = $start + 2880 * int(($at - $start + 2879) / 2880);
        my $n = ($k{NAXIS} // 0) ? 1 : 0; $n *= $k{"NAXIS$_"} for 1 .. $k{NAXIS};
        push @h, { k => \%k, at => $at, n => $n, d => \$d };
        $at += 2880 * int(($n * abs($k{BITPIX}) / 8 + ($k{PCOUNT} // 0) + 2879) / 2880);
    }
    return @h;
}
sub pixels { my ($h) = @_; my $b = $h->{k}{BITPIX}; my $s = substr ${$h->{d}}, $h->{at}, $h->{n} * abs($b) / 8;
    return $b == -32 ? unpack('f>*', $s) : $b == -64 ? unpack('d>*', $s) : $b == 32 ? unpack('l>*', $s) : die "bitpix $b" }
if ($do eq 'make' || $do eq 'add') {
    my ($nx, $ny, $expr, @cards) = @a; my $v = eval "sub { my (\$x, \$y) = \@_; $expr }" or die $@;
    my @c = $do eq 'make' ? ('SIMPLE  =                    T') : ("XTENSION= 'IMAGE   '");
    push @c, 'BITPIX  =                  -32', $nx ? 'NAXIS   =                    2' : 'NAXIS   =                    0';
    push @c, sprintf('NAXIS1  = %20d', $nx), sprintf('NAXIS2  = %20d', $ny) if $nx;
    push @c, $do eq 'make' ? 'EXTEND  =                    T' : ('PCOUNT  =                    0', 'GCOUNT  =                    1');
    my $s = join '', map { sprintf '%-80.80s', $_ } @c, @cards, 'END';
    my $p = ''; for my $y (0 .. $ny - 1) { $p .= pack 'f>*', map { $v->($_, $y) } 0 .. $nx - 1 if $nx }
    open my $f, $do eq 'make' ? '>:raw' : '>>:raw', $file or die $!; print $f block($s, ' '), block($p, "\0"); close $f or die $!;
} elsif ($do eq 'count') { print scalar(my @h = hdus()), "\n" }
else {
    my @h = hdus(); my $h = $h[$a[0]] or die "no HDU $a[0]";
    if ($do eq 'card') { my $v = $h->{k}{$a[1]} // ''; $v =~ s/^'(.*?) *'$/$1/; print "$v\n" }
    else {
        my @p = pixels($h); my $nx = $h->{k}{NAXIS1};
        if ($do eq 'dump') { my $as = $h->{k}{BITPIX} > 0 ? "%d" : "%.9g"; for my $i (0 .. $#p) { printf "%d %d $as\n", $i % $nx, int($i / $nx), $p[$i] } }
        else { my ($n, $s, $ss, $lo, $hi) = (0, 0, 0); for (@p) { next if $_ != $_; $n++; $s += $_; $lo = $_ if !defined $lo || $_ < $lo; $hi = $_ if !defined $hi || $_ > $hi }
            my $m = $n ? $s / $n : 'nan'; for (@p) { $ss += ($_ - $m) ** 2 if $_ == $_ } printf "%.9g %.9g %.9g %.9g %d %.12g\n", $m, $ss / ($n > 1 ? $n - 1 : 1), $lo // 'nan', $hi // 'nan', $n, $s }
    }
}
