"""MagicDrive: pictures of six cameras from a layout. Its networks are loaded when a clip is made."""

from dreamdrive.prior.magicdrive.prior import MAGICDRIVE, MAGICDRIVE_T
