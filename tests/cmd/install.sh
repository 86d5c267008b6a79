# make install and uninstall under DESTDIR (nothing is built: other tests use the programs); completion knows options and choices.
make -s -o all -C "$TOP" install DESTDIR="$PWD/root" PREFIX=/usr BIN="$BIN" BUILD="$BUILD" >log 2>&1 || fail "make install: $(tail -c 300 log)"
for p in "$BIN"/*; do
    n=$(basename "$p")
    [ -f "$p" ] || continue
    [ -x "root/usr/bin/$n" ] && [ -f "root/usr/share/man/man1/$n.1" ] && [ -f "root/usr/share/bash-completion/completions/$n" ] || fail "$n is not installed whole"
done
if root/usr/bin/psfgen --version >/dev/null; then pass "the installed psfgen runs"; else fail "the installed psfgen does not run"; fi
complete_words() { # WORD: what drizzle's completion offers for it
    bash -c '. root/usr/share/bash-completion/completions/drizzle; COMP_WORDS=(drizzle "$1"); COMP_CWORD=1; compopt() { :; }; _pixshear_drizzle; echo "${COMPREPLY[*]}"' sh "$1"
}
if [ "$(complete_words --pixf)" = "--pixfrac=" ]; then pass "completion of --pixf"; else fail "completion of --pixf: $(complete_words --pixf)"; fi
if [ "$(complete_words --kernel=lan)" = "lanczos2 lanczos3" ]; then pass "completion of --kernel=lan"; else fail "completion of --kernel=lan: $(complete_words --kernel=lan)"; fi
make -s -C "$TOP" uninstall DESTDIR="$PWD/root" PREFIX=/usr BIN="$BIN" BUILD="$BUILD" >log 2>&1 || fail "make uninstall: $(tail -c 300 log)"
near "files left by uninstall" "$(find root -type f | wc -l)" 0 0
