# The Debian packages, in BUILD/deb.  SIGN=FILE is the pair that their firmware
# is signed with, as for make firmware.
deb: deps-deb
	@$(MAKE) --no-print-directory $(fetched)/libsodium/fetched
	@SIGN='$(SIGN)' bash host/package/build '$(BUILD)/deb' \
		'$(fetched)/libsodium'
